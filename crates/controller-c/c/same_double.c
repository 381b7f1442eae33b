static void same_double(const char *name, uint32_t index, double found)
{
    const double expected = next_double();

    if (is_different(memcmp(&found, &expected, sizeof found) != 0)) {
        different(name, index);
        printf(" is %.17g, recorded %.17g\n", found, expected);
    }
}

