#include "counterpoint/engine/estimate/excitation.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "counterpoint/contact/thread_pool.h"
#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/estimate/torques/linear_quantities.h"
#include "counterpoint/engine/step.h"

namespace counterpoint::estimation {
namespace {

/// Instants of a period at which the sensitivity is computed, for each harmonic.
constexpr int kEachSine = 20;
/// Share of the range of a joint that a motion uses; half the range of joints without limits [rad].
constexpr double kUsed = 0.95, kFreeHalf = 0.5 * std::numbers::pi;
/// Offsets shift the middle of a joint's motion by this share of half its range, at most.
constexpr double kOffset = 0.5;
/// Directions with less than this share of the largest sensitivity at random states are not told by
/// any motion.
constexpr double kTellable = 1e-6;
/// Random states for each coordinate.
constexpr int kSamples = 30;
/// Exponent of the norms that stand for the largest and the smallest singular value.
constexpr double kNorm = 6.0;
constexpr double kDifference = 1e-5;  ///< change of a variable; variables are about 1
/// A step that lowers the logarithm of the condition number by less ends the search.
constexpr double kEnough = 1e-4;

/// Length of a step whose forces stand for those at an instant [s].
constexpr double kStep = 1e-3;

/// Values of the sums of sines at a time.
struct Sample {
  VectorX q, v, a;
};

/// The task, and the directions of parameters that motions can tell.
class Design {
 public:
  Design(const Scene& scene, const std::vector<Parameter>& parameters,
         const ExcitationOptions& options)
      : scene_(scene),
        options_(options),
        quantities_(scene, parameters),
        steps_(quantities_.step_parameters(scene.model)),
        laws_(free_steps(scene.options, kStep)) {
    const Coordinates coordinates(parameters, parameter_values(parameters, scene),
                                  scene.model.dry_friction());
    const VectorX ranges = coordinates.upper - coordinates.lower;
    scaled_ = quantities_.derivatives(coordinates, coordinates.prior) * ranges.asDiagonal();
    const int count = kEachSine * options.harmonics;
    for (int i = 0; i < count; ++i) instants_.push_back(options.duration * i / count);
    const Model& model = scene.model;
    middle_.resize(model.nv());
    half_.resize(model.nv());
    for (int i = 1; i < model.num_bodies(); ++i) {
      const JointInfo& joint = model.joint(i - 1);
      const Body& body = model.body(i);
      if (joint_nv(body.joint_type) != 1 || joint_nq(body.joint_type) != 1)
        throw InputError(
            fmt::format("joint '{}' has several coordinates; motions of joints of one "
                        "coordinate can be designed",
                        joint.name));
      const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
      middle_[body.v_index] = limited ? 0.5 * (joint.lower + joint.upper) : 0.0;
      half_[body.v_index] = kUsed * (limited ? 0.5 * (joint.upper - joint.lower) : kFreeHalf);
    }
    find_tellable();
  }

  int num_variables() const {
    return static_cast<int>(half_.size()) * (2 * options_.harmonics + 1);
  }
  int told() const { return static_cast<int>(tellable_.cols()); }

  /// Scratch of a thread.
  struct Scratch {
    explicit Scratch(const Design& design)
        : derivator(design.scene_.model, design.steps_), workspace(design.scene_.model) {}
    ParameterDerivator derivator;
    Workspace workspace;
    Inverse inverse;
    InverseParameterDerivatives d;
  };

  /// Values at a time [s] of the motion with these variables, before scaling by limits.
  Sample raw(const VectorX& x, double time) const {
    const Eigen::Index n = half_.size();
    Sample out{VectorX::Zero(n), VectorX::Zero(n), VectorX::Zero(n)};
    for (int k = 1; k <= options_.harmonics; ++k) {
      const double w = 2.0 * std::numbers::pi * k / options_.duration;
      const auto a = x.segment(n * (2 * k - 2), n), b = x.segment(n * (2 * k - 1), n);
      out.q += std::sin(w * time) * a + std::cos(w * time) * b;
      out.v += w * (std::cos(w * time) * a - std::sin(w * time) * b);
      out.a -= w * w * (std::sin(w * time) * a + std::cos(w * time) * b);
    }
    return out;
  }

  /// The motion at instants `time` [s], within the limits of joints and speed.
  std::vector<Sample> motion(const VectorX& x, const std::vector<double>& time) const {
    const Eigen::Index n = half_.size();
    VectorX farthest = VectorX::Zero(n), fastest = VectorX::Zero(n);
    for (const double t : instants_) {
      const Sample now = raw(x, t);
      farthest = farthest.cwiseMax(now.q.cwiseAbs());
      fastest = fastest.cwiseMax(now.v.cwiseAbs());
    }
    const VectorX shift = kOffset * x.tail(n).array().tanh().matrix();
    VectorX scale(n);
    for (Eigen::Index i = 0; i < n; ++i)
      scale[i] = std::min(half_[i] * (1.0 - std::abs(shift[i])) / std::max(farthest[i], 1e-12),
                          options_.speed / std::max(fastest[i], 1e-12));
    std::vector<Sample> out;
    for (const double t : time) {
      Sample& now = out.emplace_back(raw(x, t));
      now.q = middle_ + half_.cwiseProduct(shift) + scale.cwiseProduct(now.q);
      now.v = scale.cwiseProduct(now.v);
      now.a = scale.cwiseProduct(now.a);
    }
    return out;
  }

  /// Squares of the singular values, ascending.
  VectorX spectrum(const VectorX& x, Scratch& scratch) const {
    MatrixX gram = MatrixX::Zero(scaled_.cols(), scaled_.cols());
    for (const Sample& now : motion(x, instants_)) add(now, scratch, gram);
    const MatrixX told = tellable_.transpose() * gram * tellable_;
    return Eigen::SelfAdjointEigenSolver<MatrixX>(told, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .cwiseMax(1e-300);
  }

  static double condition(const VectorX& squares) {
    return std::sqrt(squares[squares.size() - 1] / squares[0]);
  }

  /// A smooth bound of the logarithm of the condition number.
  double cost(const VectorX& x, Scratch& scratch) const {
    const VectorX squares = spectrum(x, scratch);
    const double most = squares[squares.size() - 1], least = squares[0];
    const auto power = [](double ratio) { return std::pow(ratio, 0.5 * kNorm); };
    double large = 0.0, small = 0.0;
    for (const double square : squares) {
      large += power(square / most);
      small += power(least / square);
    }
    return 0.5 * std::log(most / least) + (std::log(large) + std::log(small)) / kNorm;
  }

 private:
  /// Adds the sensitivity at an instant to the Gram matrix of the parameters over their ranges.
  void add(const Sample& now, Scratch& s, MatrixX& gram) const {
    s.derivator.inverse(scene_.model, laws_, now.q, now.v, now.v + laws_.time_step * now.a, Input(),
                        s.workspace, s.inverse, s.d);
    const MatrixX rows = s.d.du * scaled_;
    gram.noalias() += rows.transpose() * rows;
  }

  void find_tellable() {
    Scratch scratch(*this);
    std::mt19937_64 generator(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const Eigen::Index n = half_.size();
    MatrixX gram = MatrixX::Zero(scaled_.cols(), scaled_.cols());
    for (Eigen::Index state = 0; state < kSamples * n; ++state) {
      Sample now{middle_, VectorX(n), VectorX(n)};
      for (Eigen::Index i = 0; i < n; ++i) {
        now.q[i] += half_[i] * uniform(generator);
        now.v[i] = options_.speed * uniform(generator);
        now.a[i] = options_.speed * uniform(generator);
      }
      add(now, scratch, gram);
    }
    const Eigen::SelfAdjointEigenSolver<MatrixX> eigen(gram);
    const VectorX& squares = eigen.eigenvalues();
    const double most = squares[squares.size() - 1];
    Eigen::Index untold = 0;
    while (untold < squares.size() && !(squares[untold] > kTellable * kTellable * most)) ++untold;
    if (untold == squares.size())
      throw InputError("no motion of this mechanism tells any of the parameters");
    tellable_ = eigen.eigenvectors().rightCols(squares.size() - untold);
  }

  const Scene& scene_;
  const ExcitationOptions& options_;
  const LinearQuantities quantities_;
  const std::vector<StepParameter> steps_;
  const SimulationOptions laws_;
  MatrixX scaled_;    ///< derivatives of the quantities by parameters in ranges
  MatrixX tellable_;  ///< columns: directions of the parameters, in ranges
  VectorX middle_, half_;
  std::vector<double> instants_;  ///< [s]
};

/// Minimizes the cost by BFGS with forward differences, shared among threads.
class MotionSearch {
 public:
  MotionSearch(const Design& design, const ExcitationOptions& options)
      : design_(design), options_(options), pool_(num_threads_of(options.threads)) {
    for (int i = 0; i < pool_.size(); ++i)
      scratch_.push_back(std::make_unique<Design::Scratch>(design));
  }

  /// The random start with the smallest condition number.
  VectorX best_start(double& condition) {
    std::mt19937_64 generator(options_.seed);
    std::normal_distribution<double> normal;
    std::vector<VectorX> starts(static_cast<std::size_t>(options_.random_starts));
    for (VectorX& x : starts) {
      x.resize(design_.num_variables());
      for (double& value : x) value = normal(generator);
    }
    std::vector<double> conditions(starts.size());
    pool_.run(static_cast<int>(starts.size()), [&](int i, int thread) {
      const auto k = static_cast<std::size_t>(i);
      conditions[k] = Design::condition(
          design_.spectrum(starts[k], *scratch_[static_cast<std::size_t>(thread)]));
    });
    const auto best = std::min_element(conditions.begin(), conditions.end()) - conditions.begin();
    condition = conditions[static_cast<std::size_t>(best)];
    return starts[static_cast<std::size_t>(best)];
  }

  /// Returns true if options.stop ended it.
  bool minimize(VectorX& x) {
    const Eigen::Index n = x.size();
    double cost = cost_of(x);
    VectorX g = gradient(x, cost);
    MatrixX B = MatrixX::Identity(n, n) / std::max(g.norm(), 1e-12);
    for (int i = 0; i < options_.iterations; ++i) {
      if (options_.stop && options_.stop()) return true;
      const VectorX step = -B * g;
      double share = 1.0, next = cost_of(x + step);
      while (!(next < cost + 1e-4 * share * g.dot(step)) && share > 1e-4) {
        share *= 0.5;
        next = cost_of(x + share * step);
      }
      if (!(next < cost - kEnough)) return false;
      const VectorX s = share * step;
      x += s;
      cost = next;
      const VectorX before = std::exchange(g, gradient(x, cost)), y = g - before;
      if (const double sy = s.dot(y); sy > 1e-12) {
        const VectorX By = B * y;
        B += (1.0 + y.dot(By) / sy) / sy * s * s.transpose() -
             (By * s.transpose() + s * By.transpose()) / sy;
      }
    }
    return false;
  }

 private:
  double cost_of(const VectorX& x) { return design_.cost(x, *scratch_[0]); }

  VectorX gradient(const VectorX& x, double cost) {
    VectorX out(x.size());
    pool_.run(static_cast<int>(x.size()), [&](int i, int thread) {
      VectorX moved = x;
      moved[i] += kDifference;
      out[i] =
          (design_.cost(moved, *scratch_[static_cast<std::size_t>(thread)]) - cost) / kDifference;
    });
    return out;
  }

  const Design& design_;
  const ExcitationOptions& options_;
  contact::ThreadPool pool_;
  std::vector<std::unique_ptr<Design::Scratch>> scratch_;
};

}  // namespace

Excitation excite(const Scene& scene, const std::vector<Parameter>& parameters, double rate,
                  const ExcitationOptions& options) {
  for (const Parameter& p : parameters)
    if (!is_linear(p.kind))
      throw InputError(
          fmt::format("parameter '{}': a motion without contact does not tell it; "
                      "expected those of --objective torque that belong to the scene",
                      p.name));
  const Design design(scene, parameters, options);
  MotionSearch search(design, options);
  Excitation out;
  VectorX x = search.best_start(out.random_condition);
  out.stopped = search.minimize(x);
  Design::Scratch scratch(design);
  out.condition = Design::condition(design.spectrum(x, scratch));
  out.told = design.told();
  const auto rows = static_cast<Eigen::Index>(std::lround(options.duration * rate)) + 1;
  for (Eigen::Index row = 0; row < rows; ++row) out.time.push_back(static_cast<double>(row) / rate);
  const std::vector<Sample> motion = design.motion(x, out.time);
  const Model& model = scene.model;
  out.q.resize(model.nv(), rows);
  out.v.resize(model.nv(), rows);
  out.force.resize(model.nv(), rows);
  const SimulationOptions laws = free_steps(scene.options, 1.0 / rate);
  Workspace workspace(model);
  Inverse inverse;
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Sample& now = motion[static_cast<std::size_t>(row)];
    out.q.col(row) = now.q;
    out.v.col(row) = now.v;
    step_inverse(model, laws, now.q, now.v, now.v + laws.time_step * now.a, workspace, inverse);
    out.force.col(row) = inverse.applied_force;
  }
  return out;
}

}  // namespace counterpoint::estimation
