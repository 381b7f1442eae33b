static float one_plus_power(float y)
{
    const power_t power = power_of_two(y);

    return fmaf(power.s, fmaf(power.q, power.f, 1.0f), 1.0f);
}

/* 1 / (1 + 2^y) of two neurons, which share a division. */
static void sigmoid(const float y[2], float u[2])
{
    const float a = one_plus_power(y[0]);
    const float b = one_plus_power(y[1]);
    const float inverse = 1.0f / (a * b);

    u[0] = b * inverse;
    u[1] = a * inverse;
}
