/* A robot without a body: links all that a controller and its radio need on a microcontroller. With
 * COUNT, it counts the instructions of a step in an emulator whose instructions take 1 ns each. */
#include "swarm_radio.h"

#ifdef COUNT
#include <stdio.h>
#endif

static swarm_t swarm;
static swarm_radio_t radio;
static swarm_stimuli_t stimuli;
static swarm_actions_t actions;
static swarm_heard_t heard[SWARM_SECTORS];
static swarm_frame_t frame;
static uint32_t noise = 1;

/* A generator of Park and Miller. */
static double uniform(void)
{
    noise = (uint32_t)((uint64_t)noise * 48271u % 2147483647u);
    return (double)noise / 2147483647.0;
}

double swarm_uniform(swarm_t *asking)
{
    (void)asking;
    return uniform();
}

double swarm_radio_uniform(swarm_radio_t *asking)
{
    (void)asking;
    return uniform();
}

static void step(void)
{
    (void)swarm_radio_receive(&radio, heard, &stimuli);
    swarm_step(&swarm, &stimuli, &actions);
    swarm_radio_send(&radio, &actions, &frame);
}

#ifdef COUNT
/* The timer SysTick of the emulated board counts down at 25 MHz, every 40 instructions. */
static volatile uint32_t *const TIMER = (volatile uint32_t *)0xe000e010;

int main(void)
{
    uint32_t i, before, after;

    swarm_init(&swarm);
    swarm_radio_init(&radio, 0);
    for (i = 0; i < SWARM_SECTORS; i++) {
        heard[i].frame.originator = 1u + i;
        heard[i].frame.hops = 1u;
        heard[i].signal = 0.5f;
    }
    TIMER[1] = 0xffffffu;
    TIMER[2] = 0;
    TIMER[0] = 5u;
    before = TIMER[2];
    for (i = 0; i < 10u; i++) {
        step();
    }
    after = TIMER[2];
    printf("%lu\n", (unsigned long)(((before - after) & 0xffffffu) * 4u));
    return 0;
}
#else
int main(void)
{
    swarm_init(&swarm);
    swarm_radio_init(&radio, 0);
    for (;;) {
        step();
    }
}
#endif
