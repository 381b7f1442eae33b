/* s * (1 + q * f) = 2^y, with s a power of two and |f| at most one half. */
typedef struct {
    float s;
    float q;
    float f;
} power_t;

static power_t power_of_two(float y)
{
    /* Adding this rounds to an integer, and leaves it plus the bias of exponents in the lowest
     * bits. */
    const float round = 12583039.0f;
    power_t power;
    float rounded;
    uint32_t bits;

    y = y < 63.0f ? y : 63.0f;
    y = y > -63.0f ? y : -63.0f;
    rounded = y + round;
    power.f = y - (rounded - round);
    power.q = @C5@;
    power.q = fmaf(power.q, power.f, @C4@);
    power.q = fmaf(power.q, power.f, @C3@);
    power.q = fmaf(power.q, power.f, @C2@);
    power.q = fmaf(power.q, power.f, @C1@);
    power.q = fmaf(power.q, power.f, @C0@);
    memcpy(&bits, &rounded, sizeof bits);
    bits <<= 23;
    memcpy(&power.s, &bits, sizeof bits);
    return power;
}
