/* The decoders' view of the spikes of motor neurons. */
static void listen(swarm_t *swarm, uint32_t substep)
{
    uint32_t i;

    for (i = 0; i < SWARM_MOTOR; i++) {
        float *filter = swarm->filter[i];
        float growth, change;

        if (swarm->spikes[MOTOR[i]] != 0u) {
            if (substep < swarm->first[i]) {
                swarm->first[i] = (uint16_t)substep;
            }
            filter[0] = 1.0f;
        } else {
            filter[0] = filter[0] * FILTER[0];
        }
        growth = FILTER[1] * filter[0];
        change = growth * (1.0f - filter[1]) - FILTER[2] * filter[1];
        filter[1] = filter[1] + change;
    }
}
