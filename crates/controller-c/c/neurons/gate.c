/* No current reaches a refractory neuron. */
static float gated(float *waiting, float current)
{
    const int is_refractory = *waiting > 0.0f;
    const float left = *waiting - 1.0f;

    *waiting = left > 0.0f ? left : 0.0f;
    return is_refractory ? 0.0f : current;
}
