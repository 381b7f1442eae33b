#include "controller.h"

#include <float.h>
#include <math.h>
#include <string.h>

#if FLT_EVAL_METHOD != 0
#error "The controller needs float arithmetic in IEEE single precision, such as SSE, VFP or soft float."
#endif
#if defined(__FAST_MATH__)
#error "The controller needs IEEE arithmetic: compile it without -ffast-math."
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
