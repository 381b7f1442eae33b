/* Dynamic synapses: a spike arrives after the delay of its axon, opens the axon's receptors, and
 * these drive a current into every postsynaptic neuron. */
static void receive(swarm_t *swarm, float *current)
{
    uint32_t axon, post;
@COUNTERS@
    for (axon = 0; axon < SWARM_SOURCES; axon++) {
        float *open = swarm->open[axon];
        uint32_t slot = swarm->clock + SWARM_SLOTS + 1u - DELAY[axon];
        float growth, loss;

        swarm->history[swarm->clock][axon] = swarm->spikes[axon];
        slot = slot >= SWARM_SLOTS ? slot - SWARM_SLOTS : slot;
        if (swarm->history[slot][axon] != 0u) {
            open[0] = 1.0f;
            open[1] = 1.0f;
            open[2] = 1.0f;
        } else {
            open[0] = open[0] * LEFT[0];
            open[1] = open[1] * LEFT[1];
            open[2] = open[2] * LEFT[2];
        }
        growth = (RISE * open[2]) * (1.0f - open[3]);
        loss = DECAY * open[3];
        open[3] = open[3] + (growth - loss);
    }
    swarm->clock = swarm->clock + 1u < SWARM_SLOTS ? swarm->clock + 1u : 0u;
    for (post = 0; post < SWARM_NEURONS; post++) {
        const float v = swarm->state[post][0];
        float sum;
        float flow;

@RECEPTORS@    }
}
