/* The loops over sources for x86-64 with AVX2 and FMA; compiled with those on. */
#define SOURCE_LOOPS dipole_source_loops_avx2
#include "source_loops.h"
