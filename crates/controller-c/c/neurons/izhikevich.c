/* Izhikevich. Constants: dt, dt A, B, C, D. State: v, u. Returns whether the neuron spikes. */
static uint8_t neuron(const float *constant, float *state, float current)
{
    const int has_spiked = state[0] >= 30.0f;
    const float u = has_spiked ? state[1] + constant[4] : state[1];
    const float v = has_spiked ? constant[3] : state[0];
    const float quadratic = fmaf(0.04f, v, 5.0f);
    float slope = fmaf(quadratic, v, 140.0f - u);
    float slope_u, next;

    slope = fmaf(0.1f, current, slope);
    next = fmaf(constant[0], slope, v);
    next = next < 30.0f ? next : 30.0f;
    next = next > -85.0f ? next : -85.0f;
    slope_u = fmaf(constant[2], v, -u);
    state[0] = next;
    state[1] = fmaf(constant[1], slope_u, u);
    return next >= 30.0f;
}
