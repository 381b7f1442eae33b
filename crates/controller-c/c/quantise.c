/* Replaces a message by a point of the lattice, which u, uniform in [0, 1), draws with
 * probabilities softmax(-beta * distance / sqrt(components)). */
static void quantise(float message[SWARM_MESSAGE], double u)
{
    float weight[POINTS];
    uint16_t digit[SWARM_MESSAGE];
    float nearest = FLT_MAX;
    float total = 0.0f;
    float sum = 0.0f;
    float target;
    uint32_t point, symbol = 0;
    uint32_t i;

    for (i = 0; i < SWARM_MESSAGE; i++) {
        message[i] = message[i] < 0.0f ? 0.0f : message[i];
        message[i] = message[i] > 1.0f ? 1.0f : message[i];
        digit[i] = 0;
    }
    for (point = 0; point < POINTS; point++) {
        float squares = 0.0f;

        for (i = 0; i < SWARM_MESSAGE; i++) {
            const float difference = LEVEL[digit[i]] - message[i];

            squares = fmaf(difference, difference, squares);
        }
        weight[point] = square_root(squares);
        nearest = weight[point] < nearest ? weight[point] : nearest;
        /* The last component runs fastest. */
        for (i = SWARM_MESSAGE; i > 0u; i--) {
            if (++digit[i - 1u] < LEVELS) {
                break;
            }
            digit[i - 1u] = 0;
        }
    }
    for (point = 0; point < POINTS; point++) {
        const power_t power = power_of_two(SLOPE * (weight[point] - nearest));

        weight[point] = power.s * fmaf(power.q, power.f, 1.0f);
        total += weight[point];
    }
    /* The symbol is the number of points with a cumulative weight of at most the target. */
    u = ((double)(uint32_t)(u * 8388608.0) + 0.5) / 8388608.0;
    target = (float)u * total;
    for (point = 0; point < POINTS; point++) {
        sum += weight[point];
        symbol += sum <= target ? 1u : 0u;
    }
    symbol = symbol < POINTS ? symbol : POINTS - 1u;
    for (i = SWARM_MESSAGE; i > 0u; i--) {
        message[i - 1u] = LEVEL[symbol % LEVELS];
        symbol /= LEVELS;
    }
}
