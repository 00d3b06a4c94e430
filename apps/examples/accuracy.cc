// Measures the cost of accuracy: the error of a double pendulum over the computing time of its
// steps.
#include <counterpoint/engine/engine.h>

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

namespace cp = counterpoint;

/// Simulates 1 s. Returns the angles at the end [rad], and the computing time in `seconds`.
cp::VectorX end_of(cp::Scene scene, cp::Integrator integrator, double time_step, double& seconds) {
  scene.options.time_step = time_step;
  scene.options.integrator = integrator;
  // No motor drives it, and runge_kutta_4 accepts smooth effects only.
  scene.options.effects.set(cp::Effect::kEffortLimits, false);
  cp::Simulator sim(std::move(scene));
  const auto start = std::chrono::steady_clock::now();
  while (sim.state().time < 1.0 - 0.5 * time_step && sim.step().succeeded()) continue;
  seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return sim.state().q;
}

int main(int count, char** arguments) {
  const std::string data = count > 1 ? arguments[1] : "data";
  const cp::Scene scene = cp::load_scene(data + "/scenes/double_pendulum.yaml");
  double seconds = 0.0;
  const cp::VectorX reference = end_of(scene, cp::Integrator::kRungeKutta4, 1e-5, seconds);
  std::printf("%-22s%10s%14s%12s\n", "integrator", "step [s]", "error [rad]", "time [ms]");
  for (const cp::Integrator integrator :
       {cp::Integrator::kSemiImplicitEuler, cp::Integrator::kImplicitMidpoint,
        cp::Integrator::kRungeKutta4}) {
    for (const double time_step : {1e-2, 1e-3, 1e-4}) {
      const cp::VectorX q = end_of(scene, integrator, time_step, seconds);
      std::printf("%-22s%10g%14.2e%12.2f\n", cp::integrator_name(integrator), time_step,
                  (q - reference).norm(), 1e3 * seconds);
    }
  }
}
