/* The index of the motor neuron that spiked first. */
static uint32_t earliest(const swarm_t *swarm, uint32_t first, uint32_t n)
{
    uint32_t i, found = 0;

    for (i = 1; i < n; i++) {
        if (swarm->first[first + i] < swarm->first[first + found]) {
            found = i;
        }
    }
    return found;
}
