/* The loops over sources for any processor. */
#define SOURCE_LOOPS dipole_source_loops_portable
#include "source_loops.h"
