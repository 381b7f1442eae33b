/* Adaptive exponential integrate and fire. Constants: dt / tau_m, V_rest, dt / tau_w, A, dt B,
 * dt / 50, theta_rest, 20 dt, V_reset. State: v, w, theta. Returns whether the neuron spikes. */
static uint8_t neuron(const float *constant, float *state, float current)
{
    const float v = state[0];
    const float upswing = exponential((v - state[2]) * 0.5f);
    float slope = fmaf(2.0f, upswing, constant[1] - v);
    float slope_w, next;

    slope = (slope - state[1]) + current;
    next = fmaf(constant[0], slope, v);
    next = next > -1e6f ? next : -1e6f;
    slope_w = fmaf(constant[3], v - constant[1], -state[1]);
    state[1] = fmaf(constant[2], slope_w, state[1]);
    if (next >= 30.0f) {
        state[1] = state[1] + constant[4];
        state[2] = state[2] + constant[7];
        state[0] = constant[8];
        return 1;
    }
    state[2] = fmaf(constant[5], constant[6] - state[2], state[2]);
    state[0] = next;
    return 0;
}
