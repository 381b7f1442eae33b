/* The weighted sum of the filtered spikes of motor neurons. */
static double filtered(const swarm_t *swarm, uint32_t first, uint32_t n, const double *weight)
{
    double sum = -0.0;
    uint32_t i;

    for (i = 0; i < n; i++) {
        sum += (double)swarm->filter[first + i][1] * weight[i];
    }
    return sum;
}
