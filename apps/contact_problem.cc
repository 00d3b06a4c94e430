// counterpoint contact-problem: solves frictional contact problems given as matrices, without
// bodies.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "command.h"
#include "counterpoint/contact/contact_space.h"
#include "counterpoint/model/types.h"
#include "report.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string folder;
  contact::ContactSpaceOptions options;
  contact::Settings settings;
  Report report;
};

/// Rows of numbers under one header line. @throws InputError naming file and line.
std::vector<std::vector<double>> read_csv(const fs::path& file, size_t columns) {
  std::ifstream in(file);
  if (!in) throw InputError(fmt::format("{}: cannot be read", file.string()));
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(in, line);  // header
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty() || line == "\r") continue;
    std::vector<double> row;
    const char* p = line.c_str();
    for (;;) {
      char* end = nullptr;
      row.push_back(std::strtod(p, &end));
      if (end == p)
        throw InputError(fmt::format("{}:{}: expected a number", file.string(), number));
      p = end;
      if (*p != ',') break;
      ++p;
    }
    if (row.size() != columns) {
      throw InputError(fmt::format("{}:{}: expected {} numbers, found {}", file.string(), number,
                                   columns, row.size()));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

contact::ContactSpaceProblem read_problem(const fs::path& folder) {
  contact::ContactSpaceProblem problem;
  const auto contacts = read_csv(folder / "q_mu.csv", 4);
  if (contacts.empty()) {
    throw InputError(fmt::format("{}: holds no contact", (folder / "q_mu.csv").string()));
  }
  const int n = 3 * static_cast<int>(contacts.size());
  problem.A.setZero(n, n);
  problem.c.resize(n);
  for (size_t i = 0; i < contacts.size(); ++i) {
    for (int r = 0; r < 3; ++r) problem.c[3 * static_cast<int>(i) + r] = contacts[i][r];
    problem.mu.push_back(contacts[i][3]);
  }
  const fs::path matrix = folder / "W.csv";
  for (const auto& entry : read_csv(matrix, 3)) {
    const double row = entry[0], column = entry[1];
    if (!(row >= 0 && row < n && column >= 0 && column < n)) {
      throw InputError(
          fmt::format("{}: entry ({}, {}) lies outside the {} x {} matrix that q_mu.csv "
                      "asks for; indices start at 0",
                      matrix.string(), row, column, n, n));
    }
    problem.A(static_cast<int>(row), static_cast<int>(column)) += entry[2];
  }
  return problem;
}

/// The folder itself if it is a problem, else its subfolders that are, by name.
std::vector<fs::path> find_problems(const fs::path& folder) {
  if (fs::exists(folder / "q_mu.csv")) return {folder};
  std::vector<fs::path> found;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (fs::exists(entry.path() / "q_mu.csv")) found.push_back(entry.path());
    }
  }
  if (found.empty()) {
    throw InputError(
        fmt::format("{}: expected a folder with W.csv (row,col,value) and q_mu.csv "
                    "(q_n,q_t1,q_t2,mu), or a folder of such folders",
                    folder.string()));
  }
  std::sort(found.begin(), found.end());
  return found;
}

Json solve(const std::string& name, const contact::ContactSpaceProblem& problem,
           Arguments& arguments, bool coulomb, bool& all_solved) {
  arguments.options.coulomb = coulomb;
  const auto start = std::chrono::steady_clock::now();
  const contact::ContactSpaceSolution solution =
      solve_contact_space(problem, arguments.options, arguments.settings);
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  // Checked against the symmetric part, which is what was solved, and against A as given.
  contact::ContactSpaceProblem symmetric = problem;
  symmetric.A = 0.5 * (problem.A + problem.A.transpose());
  const auto residuals = contact_space_residuals(symmetric, solution.f, coulomb);
  const auto given = contact_space_residuals(problem, solution.f, coulomb);
  const char* status = status_name(solution.report.status);
  all_solved = all_solved && succeeded(solution.report.status);
  fmt::print(
      "{:<38} {:>4} {:<8} {:<17} {:>5} {:>9.2f} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e} {:>9.1e}\n",
      name, problem.num_contacts(), coulomb ? "coulomb" : "convex", status,
      solution.report.iterations, time.count(), residuals.primal, residuals.dual,
      residuals.complementarity, std::max(given.dual, given.complementarity), solution.asymmetry);
  return {{"name", name},
          {"contacts", problem.num_contacts()},
          {"friction_model", coulomb ? "coulomb" : "convex"},
          {"status", status},
          {"iterations", solution.report.iterations},
          {"time_ms", time.count()},
          {"rank", solution.rank},
          {"asymmetry", solution.asymmetry},
          {"primal", residuals.primal},
          {"dual", residuals.dual},
          {"complementarity", residuals.complementarity},
          {"dual_as_given", given.dual},
          {"complementarity_as_given", given.complementarity}};
}

int run(Arguments& arguments) {
  const std::vector<fs::path> folders = find_problems(arguments.folder);
  arguments.report.begin("contact-problem", arguments.folder);
  fmt::print("{:<38} {:>4} {:<8} {:<17} {:>5} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "problem",
             "n", "friction", "status", "steps", "ms", "primal", "dual", "compl.", "as given",
             "|A - A'|");
  Json problems = Json::array();
  bool all_solved = true;
  for (const fs::path& folder : folders) {
    const contact::ContactSpaceProblem problem = read_problem(folder);
    const std::string name = fs::weakly_canonical(folder).filename().string();
    for (const bool coulomb : {false, true}) {
      problems.push_back(solve(name, problem, arguments, coulomb, all_solved));
    }
  }
  arguments.report["problems"] = std::move(problems);
  arguments.report.write();
  return all_solved ? kSuccess : kFailed;
}

}  // namespace

void add_contact_problem(CLI::App& app, Action& action) {
  CLI::App& command = *app.add_subcommand(
      "contact-problem", "Solve frictional contact problems given as matrices (W.csv, q_mu.csv)");
  auto arguments = std::make_shared<Arguments>();
  command.add_option("folder", arguments->folder, "A problem, or a folder of problems")->required();
  command
      .add_option("--compliance", arguments->options.compliance,
                  "Regularizer relative to the diagonal of W")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command.add_option("--max-iterations", arguments->settings.max_iterations, "Newton steps")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command.footer(
      "primal, dual, compl.: largest distance of the impulse from its friction cone, of the "
      "velocity\n"
      "from the dual cone, and largest power, relative to the largest impulse and free velocity, "
      "with\n"
      "the symmetric part of W; as given: the larger of the last two with W as it stands.");
  arguments->report.add_to(command);
  command.callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace counterpoint::apps
