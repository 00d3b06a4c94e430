// counterpoint contact-problem: solves frictional contact problems given as matrices, without
// bodies.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "command.h"
#include "counterpoint/contact/solver.h"
#include "counterpoint/engine/clocks.h"
#include "counterpoint/model/spatial.h"
#include "input/problem_file.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;
using contact::MatrixX;
using contact::VectorX;

struct ContactProblemArguments {
  std::string folder, friction = "both";
  contact::ContactSpaceOptions options;
  contact::Settings settings;
  Report report;
};

/// Returns the folder itself if it is a problem, else its subfolders that are, sorted by name.
std::vector<fs::path> find_problems(const fs::path& folder) {
  if (fs::exists(folder / "q_mu.csv")) return {folder};
  std::vector<fs::path> found;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (fs::exists(entry.path() / "q_mu.csv")) found.push_back(entry.path());
    }
  }
  if (!fs::exists(folder))
    throw InputError(fmt::format("{}: there is no such folder", folder.string()));
  if (found.empty()) {
    throw InputError(
        fmt::format("{}: expected a folder with W.csv (row,col,value) and q_mu.csv "
                    "(q_n,q_t1,q_t2,mu), or a folder of such folders",
                    folder.string()));
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Largest difference between c and the c that the inverse finds for v, relative to |c| + |A| |f|.
double inverse_error(const contact::ContactSpaceProblem& problem,
                     const contact::ContactSpaceSolution& solution,
                     const contact::ContactSpaceOptions& options) {
  const contact::ContactSpaceInverse inverse = invert_contact_space(problem, solution.v, options);
  const VectorX size = problem.c.cwiseAbs() + problem.A.cwiseAbs() * inverse.f.cwiseAbs();
  const double scale = size.maxCoeff();
  return scale > 0.0 ? (inverse.c - problem.c).cwiseAbs().maxCoeff() / scale : 0.0;
}

Json solve(const std::string& name, const contact::ContactSpaceProblem& problem,
           const ContactProblemArguments& arguments, bool coulomb, bool& all_solved) {
  contact::ContactSpaceOptions options = arguments.options;
  options.coulomb = coulomb;
  const double start = wall_seconds();
  const contact::ContactSpaceSolution solution =
      solve_contact_space(problem, options, arguments.settings);
  const double milliseconds = 1e3 * (wall_seconds() - start);
  // Residuals are checked against the symmetric part of A, for which the problem was solved, and
  // against A as given.
  contact::ContactSpaceProblem symmetric = problem;
  symmetric.A = 0.5 * (problem.A + problem.A.transpose());
  const auto residuals = contact_space_residuals(symmetric, solution.f, coulomb);
  const auto given = contact_space_residuals(problem, solution.f, coulomb);
  const char* status = status_name(solution.report.status);
  all_solved = all_solved && succeeded(solution.report.status);
  arguments.report.print(
      "{:<38} {:>4} {:<8} {:<17} {:>5} {:>9.2f} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e}\n",
      name, problem.num_contacts(), coulomb ? "coulomb" : "convex", status,
      solution.report.iterations, milliseconds, residuals.primal, residuals.dual,
      residuals.complementarity, std::max(given.dual, given.complementarity), solution.asymmetry);
  return {{"name", name},
          {"contacts", problem.num_contacts()},
          {"friction_model", coulomb ? "coulomb" : "convex"},
          {"status", status},
          {"iterations", solution.report.iterations},
          {"time_ms", milliseconds},
          {"rank", solution.rank},
          {"asymmetry", solution.asymmetry},
          {"primal", residuals.primal},
          {"dual", residuals.dual},
          {"complementarity", residuals.complementarity},
          {"dual_as_given", given.dual},
          {"complementarity_as_given", given.complementarity},
          {"inverse_error", inverse_error(symmetric, solution, options)}};
}

int solve_all(ContactProblemArguments& arguments) {
  const std::vector<fs::path> folders = find_problems(arguments.folder);
  std::vector<contact::ContactSpaceProblem> problems;  // all are read before any is solved
  for (const fs::path& folder : folders) problems.push_back(read_contact_problem(folder));
  arguments.report.begin("contact-problem", arguments.folder);
  arguments.report.print("{:<38} {:>4} {:<8} {:<17} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
                         "problem", "n", "friction", "status", "steps", "ms", "primal", "dual",
                         "compl.", "as given", "|A - A'|");
  Json results = Json::array();
  bool all_solved = true;
  for (size_t i = 0; i < folders.size(); ++i) {
    const std::string name = fs::weakly_canonical(folders[i]).filename().string();
    for (const bool coulomb : {false, true}) {
      if (arguments.friction != "both" && arguments.friction != (coulomb ? "coulomb" : "convex")) {
        continue;
      }
      results.push_back(solve(name, problems[i], arguments, coulomb, all_solved));
    }
  }
  arguments.report["status"] = all_solved ? "ok" : "failed";
  arguments.report["problems"] = std::move(results);
  arguments.report.write();
  return all_solved ? kSuccess : kFailed;
}

}  // namespace

void add_contact_problem(CommandLine& line) {
  auto [command, arguments] = line.add<ContactProblemArguments>(
      "contact-problem", "Solve frictional contact problems given as matrices (W.csv, q_mu.csv)",
      "primal, dual, compl.: largest distance of the impulse from its friction cone, of the "
      "velocity\n"
      "from the dual cone, and largest power, relative to the largest impulse and free velocity, "
      "with\n"
      "the symmetric part of W; as given: the larger of the last two with W as it stands.\n"
      "Example:\n  counterpoint contact-problem problems/Rover1039 --json rover.json",
      solve_all);
  command.add("folder", arguments.folder, "A problem, or a folder of problems", required);
  command.add("--friction convex|coulomb|both", arguments.friction, "convex, coulomb or both",
              show_default);
  command.add("--compliance", arguments.options.compliance,
              "Regularizer relative to the diagonal of W", show_default, positive);
  command.add("--max-iterations", arguments.settings.max_iterations, "Newton steps", show_default,
              not_negative);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
