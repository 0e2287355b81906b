// Pass shadow_map.
#include "common/blocker.glsl"
