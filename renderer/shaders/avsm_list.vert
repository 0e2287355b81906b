// Pass avsm.
#include "common/blocker.glsl"
