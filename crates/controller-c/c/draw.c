/* The smallest i with w_0 + ... + w_i > u * total, for weights e^activity. */
static uint32_t drawn(const float *activity, uint32_t n, double u)
{
    double max = (double)activity[0];
    double total = 0.0;
    double sum = 0.0;
    uint32_t i;

    for (i = 1; i < n; i++) {
        max = (double)activity[i] > max ? (double)activity[i] : max;
    }
    for (i = 0; i < n; i++) {
        total += double_exp((double)activity[i] - max);
    }
    for (i = 0; i < n; i++) {
        sum += double_exp((double)activity[i] - max);
        if (sum > u * total) {
            return i;
        }
    }
    return n - 1;
}
