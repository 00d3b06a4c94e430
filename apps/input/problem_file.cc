#include "problem_file.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "counterpoint/engine/tables.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::apps {
namespace {

namespace fs = std::filesystem;

/// The matrices are dense: 6000 x 6000 take 288 MB.
constexpr int kMaxContacts = 2000;

/// Reads c and mu, one row per contact. @throws InputError naming file and line
void read_contacts(const fs::path& file, contact::ContactSpaceProblem& problem) {
  const Table table(file);
  const int columns[] = {table.column("q_n"), table.column("q_t1"), table.column("q_t2")};
  const int friction = table.column("mu");
  if (table.num_rows() == 0) {
    throw InputError(
        fmt::format("{}: holds no contact; expected one row per contact", table.file()));
  }
  if (table.num_rows() > kMaxContacts) {
    throw InputError(
        fmt::format("{}: more than {} contacts, whose matrix would not fit; cut the "
                    "problem into its islands",
                    table.where(kMaxContacts), kMaxContacts));
  }
  problem.c.resize(3 * table.num_rows());
  for (int i = 0; i < table.num_rows(); ++i) {
    for (int r = 0; r < 3; ++r) problem.c[3 * i + r] = table.value(i, columns[r]);
    const double mu = table.value(i, friction);
    if (mu < 0.0) {
      throw InputError(fmt::format("{}: mu = {}; expected a coefficient of friction, 0 or more",
                                   table.where(i), mu));
    }
    problem.mu.push_back(mu);
  }
}

/// Reads the nonzero entries of A. @throws InputError naming file and line
void read_matrix(const fs::path& file, contact::ContactSpaceProblem& problem) {
  const Table table(file);
  const int n = static_cast<int>(problem.c.size());
  const int columns[] = {table.column("row"), table.column("col")};
  const int value = table.column("value");
  problem.A.setZero(n, n);
  std::vector<char> given(static_cast<size_t>(n) * n, 0);
  for (int i = 0; i < table.num_rows(); ++i) {
    int index[2];
    for (int k = 0; k < 2; ++k) {
      const double number = table.value(i, columns[k]);
      if (!(number >= 0.0 && number < n && number == std::floor(number))) {
        throw InputError(
            fmt::format("{}: index {}; expected a whole number from 0 to {}, the matrix being {} x "
                        "{} for the {} contacts of q_mu.csv",
                        table.where(i), number, n - 1, n, n, n / 3));
      }
      index[k] = static_cast<int>(number);
    }
    char& seen = given[static_cast<size_t>(index[0]) * n + index[1]];
    if (seen != 0) {
      throw InputError(fmt::format("{}: entry ({}, {}) is given twice; expected it once",
                                   table.where(i), index[0], index[1]));
    }
    seen = 1;
    problem.A(index[0], index[1]) = table.value(i, value);
  }
  for (int i = 0; i < n; ++i) {
    if (problem.A(i, i) < 0.0) {
      throw InputError(
          fmt::format("{}: diagonal entry {} is {}; expected a positive semidefinite matrix",
                      table.file(), i, problem.A(i, i)));
    }
  }
}

}  // namespace

contact::ContactSpaceProblem read_contact_problem(const std::filesystem::path& folder) {
  contact::ContactSpaceProblem problem;
  read_contacts(folder / "q_mu.csv", problem);
  read_matrix(folder / "W.csv", problem);
  return problem;
}

}  // namespace counterpoint::apps
