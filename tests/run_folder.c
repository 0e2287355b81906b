/* Linked into every test program: it works in a folder of its own in the build tree, wherever it was
 * started, so that the files it leaves are never among the sources. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void run_folder_enter(void) __attribute__((constructor));

static void run_folder_enter(void)
{
    if (chdir(RUN_FOLDER) != 0) {
        perror(RUN_FOLDER);
        exit(1);
    }
}
