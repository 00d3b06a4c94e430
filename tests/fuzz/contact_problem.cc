// Contact problems: q_mu.csv and W.csv, separated by a line "===".
#include "apps/input/problem_file.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read(std::string_view input) {
  constexpr std::string_view kCut = "===\n";
  const size_t cut = input.find(kCut);
  const size_t after = cut == std::string_view::npos ? input.size() : cut + kCut.size();
  write("q_mu.csv", input.substr(0, cut));
  write("W.csv", input.substr(after));
  const contact::ContactSpaceProblem problem = apps::read_contact_problem(folder());
  if (!problem.A.allFinite() || !problem.c.allFinite()) std::abort();
  if (problem.c.size() != 3 * problem.num_contacts()) std::abort();
}

}  // namespace counterpoint::fuzz
