/* The sum of weight * spikes * 0.25^rank of motor neurons. */
static double ranked(const swarm_t *swarm, uint32_t first, uint32_t n, const double *weight)
{
    double sum = -0.0;
    uint32_t i, j;

    for (i = 0; i < n; i++) {
        double share = 1.0;

        for (j = 0; j < n; j++) {
            if (swarm->first[first + j] < swarm->first[first + i]) {
                share *= 0.25;
            }
        }
        sum += (double)swarm->counts[MOTOR[first + i]] * weight[i] * share;
    }
    return sum;
}
