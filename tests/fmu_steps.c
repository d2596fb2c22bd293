/* Loads the FMU's library LIBRARY with IDENTIFIER, steps it by co-simulation along a fixed motion and
 * prints the outputs' bits. On Windows without a C runtime, which would take minutes to build. */
#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32
#include <windows.h>
#define START mainCRTStartup
#define LOAD(path) LoadLibraryA(path)
#define FIND(library, name) ((void *)GetProcAddress(library, name))
static void put(const char *text, unsigned length) {
    DWORD written;
    WriteFile(GetStdHandle(STD_OUTPUT_HANDLE), text, length, &written, NULL);
}
#else
#include <dlfcn.h>
#include <unistd.h>
#define START main
#define LOAD(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
static void put(const char *text, unsigned length) {
    if (write(1, text, length) != (ssize_t)length) {
        _exit(6);
    }
}
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *unused[3];
    void *environment;
} callbacks_t;

static void log_message(void *environment, const char *name, int status, const char *category,
                        const char *message, ...) {
    const char *texts[] = {name, category, message};
    (void)environment;
    (void)status;
    for (int k = 0; k < 3; k++) {
        unsigned length = 0;
        while (texts[k][length] != 0) {
            length++;
        }
        put(texts[k], length);
        put("\n", 1);
    }
}

int START(void) {
    static const unsigned outputs[] = {3, 4, 5, 6}, deflection = 1;
    callbacks_t callbacks = {log_message, {NULL, NULL, NULL}, NULL};
    void *library = (void *)LOAD(LIBRARY);
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
    void *spring = instantiate("steps", 1, IDENTIFIER, "", &callbacks, 0, 1);
    if (spring == NULL || setup(spring, 0, 0.0, 0.0, 0, 0.0) || enter(spring) || leave(spring)) {
        return 4;
    }
    /* Up in waves, and down to where the force has ended. */
    for (int i = 0; i < 1500; i++) {
        double t = i * 1e-3, wave = (i % 100) / 100.0;
        double x = t < 1.2 ? t - 0.08 * wave : 1.2 - 2.0 * (t - 1.2);
        union {
            double values[4];
            uint64_t words[4];
        } bits;
        char line[4 * 17];
        if (set(spring, &deflection, 1, &x) || step(spring, t, 1e-3, 1) ||
            get(spring, outputs, 4, bits.values)) {
            return 5;
        }
        for (int k = 0; k < 4; k++) {
            for (int digit = 0; digit < 16; digit++) {
                line[17 * k + digit] = "0123456789abcdef"[bits.words[k] >> (60 - 4 * digit) & 15];
            }
            line[17 * k + 16] = k < 3 ? ' ' : '\n';
        }
        put(line, sizeof line);
    }
    drop(spring);
    return 0;
}
