static double next_double(void)
{
    const uint32_t low = next_word();
    const uint64_t bits = (uint64_t)next_word() << 32 | low;
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

