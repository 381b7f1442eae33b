/* The square root, rounded to nearest. */
static float square_root(float x)
{
    uint32_t bits, root = 0, digit;
    uint64_t square;
    int32_t exponent, odd;
    float result;

    memcpy(&bits, &x, sizeof bits);
    if (bits == 0u) {
        return 0.0f;
    }
    exponent = (int32_t)(bits >> 23);
    bits &= 0x7fffffu;
    if (exponent != 0) {
        bits |= 0x800000u;
    } else {
        exponent = 1;
        while (bits < 0x800000u) {
            bits <<= 1;
            exponent--;
        }
    }
    /* x = bits 2^(exponent - 23), with bits in [2^23, 2^24). */
    exponent -= 127;
    odd = exponent & 1;
    square = (uint64_t)bits << (23 + odd);
    for (digit = 0x800000u; digit != 0u; digit >>= 1) {
        const uint64_t next = (uint64_t)root + digit;

        if (next * next <= square) {
            root += digit;
        }
    }
    /* No root of a float is half way between two floats. */
    if ((uint64_t)root * root + root < square) {
        root++;
    }
    bits = ((uint32_t)((exponent - odd) / 2 + 127) << 23) + (root - 0x800000u);
    memcpy(&result, &bits, sizeof result);
    return result;
}
