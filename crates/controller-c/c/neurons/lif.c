/* Leaky integrate and fire. Constants: dt / tau, v_rest, R, thresh, time_refrac. State: v, and the
 * remaining refractory substeps. Returns whether the neuron spikes. */
static uint8_t lif(const float *constant, float *state, float current)
{
    float slope, v;

    current = gated(&state[1], current);
    slope = fmaf(constant[2], current, constant[1] - state[0]);
    v = fmaf(constant[0], slope, state[0]);
    v = v > -1e6f ? v : -1e6f;
    if (v >= constant[3]) {
        state[0] = constant[1];
        state[1] = constant[4];
        return 1;
    }
    state[0] = v;
    return 0;
}
