/* (e^2x - 1) / (e^2x + 1) */
static float hyperbolic_tangent(float x)
{
    const power_t power = power_of_two(x * 0x1.715476p+1f);
    const float above = fmaf(power.s, power.q * power.f, power.s - 1.0f);

    return above / (above + 2.0f);
}

/* Morris and Lecar. Constants: dt / Cm, g_L, E_L, g_K, E_K, g_Ca, E_Ca, V1, 1 / V2, V3, 1 / V4,
 * dt phi. State: v, n. Returns whether the neuron spikes. */
static uint8_t neuron(const float *constant, float *state, float current)
{
    const float v = state[0];
    const float n = state[1];
    const float m = fmaf(0.5f, hyperbolic_tangent((v - constant[7]) * constant[8]), 0.5f);
    const float x = (v - constant[9]) * constant[10];
    const float n_inf = fmaf(0.5f, hyperbolic_tangent(x), 0.5f);
    const float half = 0.5f * x;
    const float cosine = 0.5f * (exponential(half) + exponential(-half));
    float share = constant[11] * cosine;
    const float leak = constant[1] * (v - constant[2]);
    const float potassium = (constant[3] * n) * (v - constant[4]);
    const float calcium = (constant[5] * m) * (v - constant[6]);
    const float out = (leak + potassium) + calcium;
    float next = fmaf(constant[0], current - out, v);

    share = share < 1.0f ? share : 1.0f;
    next = next > -85.0f ? next : -85.0f;
    next = next < 40.0f ? next : 40.0f;
    state[0] = next;
    state[1] = fmaf(share, n_inf - n, n);
    return next >= 35.5f;
}
