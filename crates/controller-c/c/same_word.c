static void same_word(const char *name, uint32_t index, uint32_t found)
{
    const uint32_t expected = next_word();

    if (is_different(found != expected)) {
        different(name, index);
        printf(" is %lu, recorded %lu\n", (unsigned long)found, (unsigned long)expected);
    }
}

