// Pass tsm_texels: over the whole target.
#include "fullscreen.vert"
