uint32_t swarm_radio_receive(swarm_radio_t *radio, const swarm_heard_t heard[SWARM_SECTORS],
    swarm_stimuli_t *stimuli)
{
    /* One draw per step, needed or not. */
    const double u = swarm_radio_uniform(radio);
    uint32_t valid[SWARM_SECTORS];
    uint32_t n_valid = 0;
    uint32_t sector;

    for (sector = 0; sector < SWARM_SECTORS; sector++) {
        const swarm_frame_t *frame = &heard[sector].frame;

        if (frame->originator != radio->number && frame->hops < MAX_HOPS) {
            valid[n_valid++] = sector;
        }
    }
    if (n_valid == 0u) {
        sector = SWARM_NO_FRAME;
        no_frame(&radio->received);
    } else {
        const uint32_t choice = (uint32_t)(u * (double)n_valid);

        sector = valid[choice < n_valid ? choice : n_valid - 1u];
        radio->received = heard[sector].frame;
@OBSERVE@    }
@STIMULI@    return sector;
}
