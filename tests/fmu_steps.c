/* Loads an FMU's library, steps it by co-simulation along a fixed motion and prints the outputs' bits.
 *
 *     fmu_steps LIBRARY GUID */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define LOAD(path) LoadLibraryA(path)
#define FIND(library, name) ((void *)GetProcAddress(library, name))
#else
#include <dlfcn.h>
#define LOAD(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *unused[3];
    void *environment;
} callbacks_t;

static void log_message(void *environment, const char *name, int status, const char *category,
                        const char *message, ...) {
    (void)environment;
    printf("%s %d %s %s\n", name, status, category, message);
}

int main(int count, char **arguments) {
    static const unsigned outputs[] = {3, 4, 5, 6}, deflection = 1;
    callbacks_t callbacks = {log_message, {NULL, NULL, NULL}, NULL};
    if (count < 3) {
        return 2;
    }
    void *library = (void *)LOAD(arguments[1]);
    if (library == NULL) {
        return 3;
    }
    void *(*instantiate)(const char *, int, const char *, const char *, const callbacks_t *, int,
                         int) = FIND(library, "fmi2Instantiate");
    int (*setup)(void *, int, double, double, int, double) = FIND(library, "fmi2SetupExperiment");
    int (*enter)(void *) = FIND(library, "fmi2EnterInitializationMode");
    int (*leave)(void *) = FIND(library, "fmi2ExitInitializationMode");
    int (*set)(void *, const unsigned *, size_t, const double *) = FIND(library, "fmi2SetReal");
    int (*get)(void *, const unsigned *, size_t, double *) = FIND(library, "fmi2GetReal");
    int (*step)(void *, double, double, int) = FIND(library, "fmi2DoStep");
    void (*drop)(void *) = FIND(library, "fmi2FreeInstance");
    void *spring = instantiate("steps", 1, arguments[2], "", &callbacks, 0, 1);
    if (spring == NULL || setup(spring, 0, 0.0, 0.0, 0, 0.0) || enter(spring) || leave(spring)) {
        return 4;
    }
    /* Up in waves, and down to where the force has ended. */
    for (int i = 0; i < 1500; i++) {
        double t = i * 1e-3, wave = (i % 100) / 100.0;
        double x = t < 1.2 ? t - 0.08 * wave : 1.2 - 2.0 * (t - 1.2);
        double values[4];
        if (set(spring, &deflection, 1, &x) || step(spring, t, 1e-3, 1) ||
            get(spring, outputs, 4, values)) {
            return 5;
        }
        for (int k = 0; k < 4; k++) {
            uint64_t word;
            memcpy(&word, &values[k], sizeof word);
            printf("%08x%08x ", (unsigned)(word >> 32), (unsigned)word);
        }
        printf("\n");
    }
    drop(spring);
    return 0;
}
