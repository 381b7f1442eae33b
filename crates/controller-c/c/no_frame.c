/* The frame of a robot that has nothing to relay: no receiver accepts it. */
static void no_frame(swarm_frame_t *frame)
{
    memset(frame, 0, sizeof *frame);
    frame->originator = SWARM_NO_FRAME;
    frame->hops = SWARM_NO_FRAME;
}
