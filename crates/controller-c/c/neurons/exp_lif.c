/* Exponential integrate and fire. Constants: dt / tau, v_rest, thresh, time_refrac. State: v, and
 * the remaining refractory substeps. Returns whether the neuron spikes. */
static uint8_t neuron(const float *constant, float *state, float current)
{
    float upswing, slope, v;

    current = gated(&state[1], current);
    upswing = exponential(state[0] - constant[2]);
    slope = fmaf(0.3f, upswing, constant[1] - state[0]);
    slope = fmaf(0.6f, current, slope);
    v = fmaf(constant[0], slope, state[0]);
    v = v > -1e6f ? v : -1e6f;
    if (v >= 30.0f) {
        state[0] = constant[1];
        state[1] = constant[3];
        return 1;
    }
    state[0] = v;
    return 0;
}
