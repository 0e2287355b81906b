/* The loops over rows of sources for any processor. */
#define ROW_LOOPS dipole_row_loops_portable
#include "row_loops.h"
