// Elementary functions of SLEEF without fused products, within 1 unit in the last place; its
// documentation promises the same results on all processors ("bit-identical", functions cinz_).
#include <sleef.h>

extern "C" {

double counterpoint_acos(double x) { return Sleef_cinz_acosd1_u10purec(x); }
double counterpoint_asin(double x) { return Sleef_cinz_asind1_u10purec(x); }
double counterpoint_atan(double x) { return Sleef_cinz_atand1_u10purec(x); }
double counterpoint_atan2(double y, double x) { return Sleef_cinz_atan2d1_u10purec(y, x); }
double counterpoint_cbrt(double x) { return Sleef_cinz_cbrtd1_u10purec(x); }
double counterpoint_cos(double x) { return Sleef_cinz_cosd1_u10purec(x); }
double counterpoint_cosh(double x) { return Sleef_cinz_coshd1_u10purec(x); }
double counterpoint_exp(double x) { return Sleef_cinz_expd1_u10purec(x); }
double counterpoint_exp2(double x) { return Sleef_cinz_exp2d1_u10purec(x); }
double counterpoint_expm1(double x) { return Sleef_cinz_expm1d1_u10purec(x); }
double counterpoint_hypot(double x, double y) { return Sleef_cinz_hypotd1_u05purec(x, y); }
double counterpoint_log(double x) { return Sleef_cinz_logd1_u10purec(x); }
double counterpoint_log10(double x) { return Sleef_cinz_log10d1_u10purec(x); }
double counterpoint_log1p(double x) { return Sleef_cinz_log1pd1_u10purec(x); }
double counterpoint_log2(double x) { return Sleef_cinz_log2d1_u10purec(x); }
double counterpoint_pow(double x, double y) { return Sleef_cinz_powd1_u10purec(x, y); }
double counterpoint_sin(double x) { return Sleef_cinz_sind1_u10purec(x); }
double counterpoint_sinh(double x) { return Sleef_cinz_sinhd1_u10purec(x); }
double counterpoint_tan(double x) { return Sleef_cinz_tand1_u10purec(x); }
double counterpoint_tanh(double x) { return Sleef_cinz_tanhd1_u10purec(x); }

void counterpoint_sincos(double x, double* sine, double* cosine) {
  const Sleef_double_2 both = Sleef_cinz_sincosd1_u10purec(x);
  *sine = both.x;
  *cosine = both.y;
}

// GCC in ISO mode joins calls of sin and cos in one of sincos and knows no other name for it.
__attribute__((visibility("hidden"))) void sincos(double x, double* sine, double* cosine) {
  counterpoint_sincos(x, sine, cosine);
}

}  // extern "C"
