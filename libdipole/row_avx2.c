/* The loops over rows of sources for x86-64 with AVX2 and FMA; compiled with those on. */
#define ROW_LOOPS dipole_row_loops_avx2
#include "row_loops.h"
