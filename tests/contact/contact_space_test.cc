#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "counterpoint/contact/solver.h"
#include "support/paths.h"

namespace counterpoint::contact::contact_space_test {
namespace {

namespace fs = std::filesystem;

std::vector<std::vector<double>> read_numbers(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  std::string line, cell;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ','))
      rows.back().push_back(std::strtod(cell.c_str(), nullptr));
  }
  return rows;
}

ContactSpaceProblem read_problem(const fs::path& folder) {
  ContactSpaceProblem problem;
  const auto contacts = read_numbers(folder / "q_mu.csv");
  const int n = 3 * static_cast<int>(contacts.size());
  problem.A.setZero(n, n);
  problem.c.resize(n);
  for (int i = 0; i < n; ++i) problem.c[i] = contacts[i / 3][i % 3];
  for (const auto& contact : contacts) problem.mu.push_back(contact[3]);
  for (const auto& e : read_numbers(folder / "W.csv")) {
    problem.A(static_cast<int>(e[0]), static_cast<int>(e[1])) += e[2];
  }
  return problem;
}

TEST(ContactSpace, SolvesEveryRecordedProblem) {
  const fs::path root = fs::path(test::shared_data()) / "contact_problems";
  if (!fs::exists(root)) GTEST_SKIP() << root << " is missing: recorded contact problems not tried";
  int problems = 0;
  for (const auto& entry : fs::directory_iterator(root)) {
    if (!fs::exists(entry.path() / "q_mu.csv")) continue;
    ++problems;
    ContactSpaceProblem problem = read_problem(entry.path());
    // Some matrices are not symmetric; the symmetric part is solved.
    problem.A = (0.5 * (problem.A + problem.A.transpose())).eval();
    for (const bool coulomb : {false, true}) {
      ContactSpaceOptions options;
      options.coulomb = coulomb;
      const ContactSpaceSolution solution = solve_contact_space(problem, options, Settings{});
      EXPECT_TRUE(succeeded(solution.report.status)) << entry.path() << coulomb;
      const auto residuals = contact_space_residuals(problem, solution.f, coulomb);
      constexpr double kSolved = 1e-6;  // required; the compliance of 1e-8 allows about 1e-7
      EXPECT_LT(residuals.primal, kSolved) << entry.path() << coulomb;
      EXPECT_LT(residuals.dual, kSolved) << entry.path() << coulomb;
      EXPECT_LT(residuals.complementarity, kSolved) << entry.path() << coulomb;
    }
  }
  EXPECT_GE(problems, 11);
}

TEST(ContactSpace, WrongSizesAndNotANumberAreReported) {
  ContactSpaceProblem problem;
  problem.A = MatrixX::Identity(3, 3);
  problem.c = VectorX::Zero(6);
  problem.mu = {0.5};
  EXPECT_EQ(solve_contact_space(problem, {}, {}).report.status, Status::kInvalidLaw);
  problem.c = VectorX::Constant(3, std::nan(""));
  EXPECT_EQ(solve_contact_space(problem, {}, {}).report.status, Status::kNotFinite);
}

}  // namespace
}  // namespace counterpoint::contact::contact_space_test
