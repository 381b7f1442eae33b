/* Compares the controller with the recorded episodes of test_vectors.bin, bit by bit. */
@INCLUDES@
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A robot with the numbers that it drew in this step. */
typedef struct {
    swarm_t swarm;
@RADIO_MEMBER@    double draws[@N_DRAWS@ + 1];
    uint32_t n_drawn;
    double radio_draw;
} robot_t;

static FILE *file;
static uint32_t trial, step, robot;
static int n_differences;
@NO_COMPARISON@
static uint32_t next_word(void)
{
    unsigned char bytes[4];

    if (fread(bytes, 1, sizeof bytes, file) != sizeof bytes) {
        printf("the test vectors end too early: make them again\n");
        exit(2);
    }
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16
        | (uint32_t)bytes[3] << 24;
}

static float next_float(void)
{
    const uint32_t bits = next_word();
    float value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

@NEXT_DOUBLE@static void different(const char *name, uint32_t index)
{
    printf("first difference: trial %lu, step %lu, robot %lu: %s[%lu]", (unsigned long)trial,
        (unsigned long)step, (unsigned long)robot, name, (unsigned long)index);
    n_differences++;
}

/* Only the first difference counts. */
static int is_different(int differs)
{
    return differs && n_differences == 0@AND_COMPARED@;
}

static void same_float(const char *name, uint32_t index, float found)
{
    const float expected = next_float();

    if (is_different(memcmp(&found, &expected, sizeof found) != 0)) {
        different(name, index);
        printf(" is %.9g, recorded %.9g\n", (double)found, (double)expected);
    }
}

@DOUBLES@@SAME_WORD@@RANDOM@static const char *const ENSEMBLES[] = {
@ENSEMBLES@};
static const uint32_t ENSEMBLE_ENDS[] = {
@ENSEMBLE_ENDS@};

static void same_neurons(float (*value)(const swarm_t *, uint32_t), const swarm_t *swarm)
{
    uint32_t neuron, ensemble = 0, first = 0;

    for (neuron = 0; neuron < SWARM_NEURONS; neuron++) {
        while (neuron >= ENSEMBLE_ENDS[ensemble]) {
            first = ENSEMBLE_ENDS[ensemble];
            ensemble++;
        }
        same_float(ENSEMBLES[ensemble], neuron - first, value(swarm, neuron));
    }
}

static void test_controller(robot_t *tested)
{
    swarm_stimuli_t stimuli;
    swarm_actions_t actions;
    uint32_t i;

    memset(&stimuli, 0, sizeof stimuli);
@STIMULI@@DRAWS@    tested->n_drawn = 0;
    swarm_step(&tested->swarm, &stimuli, &actions);
    if (n_differences == 0 && tested->n_drawn != @N_DRAWS@u) {
        different("number of draws", 0);
        printf(" is %lu, expected %lu\n", (unsigned long)tested->n_drawn, @N_DRAWS@ul);
    }
    same_neurons(swarm_activity, &tested->swarm);
@VOLTAGES@@ACTIONS@}

int main(int argc, char **argv)
{
    static const char magic[] = "swarm-c1";
    const char *path = argc > 1 ? argv[1] : "test_vectors.bin";
    char found[8];
    robot_t *robots;
    uint32_t first_number, n_robots, n_steps, n_records, record;

    file = fopen(path, "rb");
    if (file == NULL) {
        printf("%s cannot be read\n", path);
        return 2;
    }
    if (fread(found, 1, sizeof found, file) != sizeof found || memcmp(found, magic, 8) != 0) {
        printf("%s has no test vectors\n", path);
        return 2;
    }
    first_number = next_word();
    n_robots = next_word();
    n_steps = next_word();
    n_records = next_word();
    robots = malloc((size_t)n_robots * sizeof *robots);
    if (robots == NULL || n_records == 0) {
        printf("no memory, or no records\n");
        return 2;
    }
    for (record = 0; record < n_records && n_differences == 0; record++) {
        robot = record % n_robots;
        step = record / n_robots % n_steps;
        trial = record / n_robots / n_steps;
        if (step == 0) {
            swarm_init(&robots[robot].swarm);
            robots[robot].swarm.user = &robots[robot];
@INIT_RADIO@        }
        test_controller(&robots[robot]);
    }
    if (n_differences == 0 && fgetc(file) != EOF) {
        printf("the test vectors belong to another controller\n");
        return 2;
    }
    fclose(file);
    free(robots);
@FIRST@    if (n_differences == 0) {
        printf("%lu robot-steps, 0 bits differ\n", (unsigned long)n_records);
    }
    return n_differences == 0 ? 0 : 1;
}
