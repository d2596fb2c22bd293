/* What the loader of Windows calls in win64.dll in place of a C runtime's start: nothing is to be prepared. */
int DllMainCRTStartup(void *library, unsigned long reason, void *reserved) {
    (void)library;
    (void)reason;
    (void)reserved;
    return 1;
}
