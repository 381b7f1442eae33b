/* e^x in double precision.
 *
 * Copyright (C) 2004 by Sun Microsystems, Inc. All rights reserved.
 * Permission to use, copy, modify, and distribute this software is freely granted, provided that
 * this notice is preserved. (FreeBSD, msun/src/e_exp.c; a constant factor of the last line is
 * computed as in the crate libm.) */
static double double_of_bits(uint32_t high)
{
    const uint64_t bits = (uint64_t)high << 32;
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

static double double_exp(double x)
{
    uint64_t bits;
    uint32_t high;
    int32_t k = 0;
    double hi, lo, xx, c, y;

    memcpy(&bits, &x, sizeof bits);
    high = (uint32_t)(bits >> 32) & 0x7fffffffu;
    if (high >= 0x4086232bu) {
        if (x > 709.782712893383973096) {
            return x * double_of_bits(0x7fe00000u);
        }
        if (x < -745.13321910194110842) {
            return 0.0;
        }
    }
    if (high > 0x3fd62e42u) {
        const int32_t sign = (int32_t)(bits >> 63);

        if (high >= 0x3ff0a2b2u) {
            k = (int32_t)(1.44269504088896338700e+00 * x + (sign ? -0.5 : 0.5));
        } else {
            k = 1 - sign - sign;
        }
        hi = x - (double)k * 6.93147180369123816490e-01;
        lo = (double)k * 1.90821492927058770002e-10;
        x = hi - lo;
    } else if (high > 0x3e300000u) {
        hi = x;
        lo = 0.0;
    } else {
        return 1.0 + x;
    }
    xx = x * x;
    c = x - xx * (1.66666666666666019037e-01
        + xx * (-2.77777777770155933842e-03
        + xx * (6.61375632143793436117e-05
        + xx * (-1.65339022054652515390e-06 + xx * 4.13813679705723846039e-08))));
    y = 1.0 + (x * c / (2.0 - c) - lo + hi);
    if (k > 1023) {
        y *= double_of_bits(0x7fe00000u);
        k -= 1023;
    } else if (k < -1022) {
        y *= double_of_bits(0x03600000u); /* 2^-969: y stays normal. */
        k += 969;
    }
    return y * double_of_bits((uint32_t)(1023 + k) << 20);
}
