static float power_minus_one(float y)
{
    const power_t power = power_of_two(y);

    return fmaf(power.s, power.q * power.f, power.s - 1.0f);
}

/* (2^y - 1) / (2^y + 1) of two neurons, which share a division. */
static void hyperbolic(const float y[2], float u[2])
{
    const float above_a = power_minus_one(y[0]);
    const float above_b = power_minus_one(y[1]);
    const float a = above_a + 2.0f;
    const float b = above_b + 2.0f;
    const float inverse = 1.0f / (a * b);

    u[0] = above_a * (b * inverse);
    u[1] = above_b * (a * inverse);
}
