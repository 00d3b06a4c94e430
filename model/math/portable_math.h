// Elementary functions with the same bits on every processor. The compiler options of the project
// include this file first everywhere: calls of sin and the others, also those within Eigen, become
// calls of counterpoint_sin and so on (portable_math.cc). The C library's functions choose code
// with fused products where the processor has them, and change with its version.
#pragma once

#pragma redefine_extname acos counterpoint_acos
#pragma redefine_extname asin counterpoint_asin
#pragma redefine_extname atan counterpoint_atan
#pragma redefine_extname atan2 counterpoint_atan2
#pragma redefine_extname cbrt counterpoint_cbrt
#pragma redefine_extname cos counterpoint_cos
#pragma redefine_extname cosh counterpoint_cosh
#pragma redefine_extname exp counterpoint_exp
#pragma redefine_extname exp2 counterpoint_exp2
#pragma redefine_extname expm1 counterpoint_expm1
#pragma redefine_extname hypot counterpoint_hypot
#pragma redefine_extname log counterpoint_log
#pragma redefine_extname log10 counterpoint_log10
#pragma redefine_extname log1p counterpoint_log1p
#pragma redefine_extname log2 counterpoint_log2
#pragma redefine_extname pow counterpoint_pow
#pragma redefine_extname sin counterpoint_sin
#pragma redefine_extname sincos counterpoint_sincos
#pragma redefine_extname sinh counterpoint_sinh
#pragma redefine_extname tan counterpoint_tan
#pragma redefine_extname tanh counterpoint_tanh
