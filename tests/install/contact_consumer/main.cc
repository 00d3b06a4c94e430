// A mass of 1 kg hits the ground after 1 s of free fall: forward problem, and back by the inverse.
#include <counterpoint/contact/solver.h>

#include <cstdio>

int main() {
  using namespace counterpoint::contact;
  ContactSpaceProblem problem;
  problem.A = MatrixX::Identity(3, 3);
  problem.c = VectorX::Zero(3);
  problem.c[0] = -9.81;
  problem.mu = {0.5};
  const ContactSpaceOptions options;
  const ContactSpaceSolution forward = solve_contact_space(problem, options, Settings{});
  const ContactSpaceInverse inverse = invert_contact_space(problem, forward.v, options);
  if (!succeeded(forward.report.status) || inverse.f != forward.f) return 1;
  std::printf("The ground gives %.6f N s, the inverse the same.\n", forward.f[0]);
}
