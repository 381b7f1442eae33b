/* e^x */
static float exponential(float x)
{
    const power_t power = power_of_two(x * 0x1.715476p+0f);

    return power.s * fmaf(power.q, power.f, 1.0f);
}
