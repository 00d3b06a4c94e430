#include "counterpoint/contact/linear/elimination_order.h"

#include <algorithm>

namespace counterpoint::contact {
namespace {

// A front is merged into its parent if the operations on the zeros that this creates are fewer than
// kFrontCost, the cost of a separate front, plus kMoveCost for each entry of its Schur complement
// that would be moved.
constexpr double kFrontCost = 600.0;
constexpr double kMoveCost = 6.0;

// Returns the number of multiplications and additions of a front's elimination.
double operations(double weight, double below_weight) {
  const double rows = weight + below_weight;
  const auto squares = [](double n) { return n * (n + 1.0) * (2.0 * n + 1.0) / 6.0; };
  return squares(rows) - squares(below_weight);
}

}  // namespace

void EliminationOrder::compute(const std::vector<int>& weights,
                               const std::vector<std::pair<int, int>>& couples) {
  const size_t n = weights.size();
  weight_ = weights;
  total_ = 0;
  for (const int w : weights) total_ += w;
  left_ = total_;
  stamp_ = 0;
  for (auto* v : {&mark_, &outside_stamp_, &outside_}) v->assign(n, 0);
  for (auto* v : {&next_, &previous_, &member_next_, &element_parent_, &front_of_pivot_})
    v->assign(n, -1);
  for (auto* v : {&degree_, &element_begin_, &element_end_, &element_weight_}) v->resize(n);
  member_last_.resize(n);
  for (size_t i = 0; i < n; ++i) member_last_[i] = static_cast<int>(i);
  head_.assign(total_ + 1, -1);
  rows_.clear();
  below_.clear();
  raw_.clear();
  raw_pivot_.clear();
  build_graph(couples);
  least_ = 0;
  // Inserts from the back, so that the lowest number comes first among equal degrees.
  for (int i = static_cast<int>(n) - 1; i >= 0; --i) {
    int degree = 0;
    for (int k = 0; k < length_[i]; ++k) degree += weight_[graph_[start_[i] + k]];
    insert(i, degree);
  }
  while (left_ > 0) eliminate(least_degree_node());
  merge_fronts();
  number_fronts();
}

void EliminationOrder::build_graph(const std::vector<std::pair<int, int>>& couples) {
  const size_t n = weight_.size();
  length_.assign(n, 0);
  num_elements_.assign(n, 0);
  for (const auto& [a, b] : couples) {
    ++length_[a];
    ++length_[b];
  }
  start_.resize(n);
  int offset = 0;
  for (size_t i = 0; i < n; ++i) {
    start_[i] = offset;
    offset += length_[i];
    length_[i] = 0;
  }
  graph_.resize(offset);
  for (const auto& [a, b] : couples) {
    graph_[start_[a] + length_[a]++] = b;
    graph_[start_[b] + length_[b]++] = a;
  }
  for (size_t i = 0; i < n; ++i) {
    int* list = graph_.data() + start_[i];
    std::sort(list, list + length_[i]);
    length_[i] = static_cast<int>(std::unique(list, list + length_[i]) - list);
  }
}

void EliminationOrder::insert(int node, int degree) {
  degree_[node] = degree;
  previous_[node] = -1;
  next_[node] = head_[degree];
  if (head_[degree] >= 0) previous_[head_[degree]] = node;
  head_[degree] = node;
  least_ = std::min(least_, degree);
}

void EliminationOrder::remove(int node) {
  if (previous_[node] >= 0) {
    next_[previous_[node]] = next_[node];
  } else {
    head_[degree_[node]] = next_[node];
  }
  if (next_[node] >= 0) previous_[next_[node]] = previous_[node];
}

int EliminationOrder::least_degree_node() {
  while (head_[least_] < 0) ++least_;
  return head_[least_];
}

// Merges `node`, with the nodes merged into it, into `into`.
void EliminationOrder::absorb(int node, int into) {
  member_next_[member_last_[into]] = node;
  member_last_[into] = member_last_[node];
  weight_[into] += weight_[node];
  weight_[node] = 0;
}

void EliminationOrder::eliminate(int pivot) {
  remove(pivot);
  gather_pivot_row(pivot);
  count_outside(pivot);
  const int begin = element_begin_[pivot];
  hashes_.clear();
  for (int k = begin; k < element_end_[pivot]; ++k) update(rows_[k], pivot);
  merge_indistinguishable();
  // The remaining nodes of the row form the new element.
  int end = begin;
  element_weight_[pivot] = 0;
  for (int k = begin; k < element_end_[pivot]; ++k) {
    if (weight_[rows_[k]] == 0) continue;
    element_weight_[pivot] += weight_[rows_[k]];
    rows_[end++] = rows_[k];
  }
  element_end_[pivot] = end;
  rows_.resize(end);
  left_ -= weight_[pivot];
  for (int k = begin; k < end; ++k) {
    const int i = rows_[k];
    const int rest = element_weight_[pivot] - weight_[i];
    insert(i, std::min(left_ - weight_[i], degree_[i] + rest));
  }
  keep_front(pivot);
}

// Collects and marks the live neighbours of the pivot, and absorbs its elements.
void EliminationOrder::gather_pivot_row(int pivot) {
  ++stamp_;
  mark_[pivot] = stamp_;
  element_begin_[pivot] = static_cast<int>(rows_.size());
  element_weight_[pivot] = 0;
  const auto take = [&](int i) {
    if (weight_[i] == 0 || mark_[i] == stamp_) return;
    mark_[i] = stamp_;
    element_weight_[pivot] += weight_[i];
    remove(i);
    rows_.push_back(i);
  };
  const int* list = graph_.data() + start_[pivot];
  for (int k = 0; k < num_elements_[pivot]; ++k) {
    const int e = list[k];
    if (element_parent_[e] >= 0) continue;
    for (int r = element_begin_[e]; r < element_end_[e]; ++r) take(rows_[r]);
    element_parent_[e] = pivot;
  }
  for (int k = num_elements_[pivot]; k < length_[pivot]; ++k) take(list[k]);
  element_end_[pivot] = static_cast<int>(rows_.size());
}

// Finds, for every element that meets the pivot's row, the weight of its nodes outside that row.
void EliminationOrder::count_outside(int pivot) {
  for (int k = element_begin_[pivot]; k < element_end_[pivot]; ++k) {
    const int i = rows_[k];
    for (int j = 0; j < num_elements_[i]; ++j) {
      const int e = graph_[start_[i] + j];
      if (element_parent_[e] >= 0) continue;
      if (outside_stamp_[e] != stamp_) {
        outside_stamp_[e] = stamp_;
        outside_[e] = element_weight_[e];
      }
      outside_[e] -= weight_[i];
    }
  }
}

// Updates a node of the pivot's row: rebuilds its list of elements and neighbours, its degree
// without the row itself, and a hash of the list. A node that touches nothing else is eliminated
// with the pivot. The new list is no longer than the old one, since the pivot or an element
// absorbed by it has gone.
void EliminationOrder::update(int node, int pivot) {
  int* list = graph_.data() + start_[node];
  scratch_.clear();
  int degree = 0;
  unsigned hash = 0;
  const auto keep = [&](int i, int weight) {
    degree += weight;
    hash += static_cast<unsigned>(i);
    scratch_.push_back(i);
  };
  for (int k = 0; k < num_elements_[node]; ++k) {
    const int e = list[k];
    if (element_parent_[e] >= 0) continue;
    if (outside_[e] > 0) {
      keep(e, outside_[e]);
    } else {
      element_parent_[e] = pivot;  // aggressive absorption: wholly inside the row
    }
  }
  const int elements = static_cast<int>(scratch_.size());
  for (int k = num_elements_[node]; k < length_[node]; ++k) {
    const int i = list[k];
    if (weight_[i] > 0 && mark_[i] != stamp_) keep(i, weight_[i]);
  }
  if (degree == 0) return absorb(node, pivot);
  scratch_.insert(scratch_.begin() + elements, pivot);
  std::copy(scratch_.begin(), scratch_.end(), list);
  num_elements_[node] = elements + 1;
  length_[node] = static_cast<int>(scratch_.size());
  degree_[node] = degree;
  hashes_.emplace_back(hash, node);
}

void EliminationOrder::merge_indistinguishable() {
  std::sort(hashes_.begin(), hashes_.end());
  for (size_t a = 0; a < hashes_.size(); ++a) {
    const int node = hashes_[a].second;
    if (weight_[node] == 0) continue;
    bool marked = false;
    for (size_t b = a + 1; b < hashes_.size() && hashes_[b].first == hashes_[a].first; ++b) {
      const int other = hashes_[b].second;
      if (weight_[other] == 0) continue;
      if (!marked) {
        ++stamp_;
        for (int k = 0; k < length_[node]; ++k) mark_[graph_[start_[node] + k]] = stamp_;
        marked = true;
      }
      if (indistinguishable(node, other)) absorb(other, node);
    }
  }
}

// Returns whether both have the same list; that of `a` is marked.
bool EliminationOrder::indistinguishable(int a, int b) {
  if (length_[a] != length_[b] || num_elements_[a] != num_elements_[b]) return false;
  const int* list = graph_.data() + start_[b];
  return std::all_of(list, list + length_[b], [&](int i) { return mark_[i] == stamp_; });
}

// Stores the front of a pivot. Its rows are stored by node, as they are now: nodes merged later may
// lie outside.
void EliminationOrder::keep_front(int pivot) {
  front_of_pivot_[pivot] = static_cast<int>(raw_.size());
  Front front;
  front.parent = -1;
  front.weight = weight_[pivot];
  front.below_weight = element_weight_[pivot];
  front.below_begin = static_cast<int>(below_.size());
  for (int k = element_begin_[pivot]; k < element_end_[pivot]; ++k) {
    for (int i = rows_[k]; i >= 0; i = member_next_[i]) below_.push_back(i);
  }
  front.below_end = static_cast<int>(below_.size());
  raw_.push_back(front);
  raw_pivot_.push_back(pivot);
  weight_[pivot] = 0;
}

// Merges small fronts into their parents. Parents come after their children here.
void EliminationOrder::merge_fronts() {
  const int count = static_cast<int>(raw_.size());
  merged_into_.assign(count, -1);
  for (int f = 0; f < count; ++f) {
    const int e = element_parent_[raw_pivot_[f]];
    raw_[f].parent = e >= 0 ? front_of_pivot_[e] : -1;
  }
  for (int f = 0; f < count; ++f) {
    Front& child = raw_[f];
    if (child.parent < 0) continue;
    Front& parent = raw_[child.parent];
    const int weight = child.weight + parent.weight;
    const double below = child.below_weight;
    const double more = operations(weight, parent.below_weight) - operations(child.weight, below) -
                        operations(parent.weight, parent.below_weight);
    if (more > kFrontCost + kMoveCost * 0.5 * below * below) continue;
    merged_into_[f] = child.parent;
    parent.weight = weight;
  }
}

// Numbers the fronts in postorder and assigns the nodes to them.
void EliminationOrder::number_fronts() {
  const int count = static_cast<int>(raw_.size());
  const auto keeper = [&](int f) {
    while (f >= 0 && merged_into_[f] >= 0) f = merged_into_[f];
    return f;
  };
  first_child_.assign(count + 1, -1);
  sibling_.assign(count, -1);
  for (int f = count - 1; f >= 0; --f) {
    if (merged_into_[f] >= 0) continue;
    const int parent = keeper(raw_[f].parent);
    int& head = first_child_[parent >= 0 ? parent : count];
    sibling_[f] = head;
    head = f;
  }
  fronts_.clear();
  new_number_.assign(count, -1);
  stack_.clear();
  for (int f = first_child_[count]; f >= 0;) {
    while (first_child_[f] >= 0) {
      stack_.push_back(f);
      f = first_child_[f];
    }
    for (;;) {
      new_number_[f] = static_cast<int>(fronts_.size());
      fronts_.push_back(raw_[f]);
      if (sibling_[f] >= 0 || stack_.empty()) break;
      f = stack_.back();
      stack_.pop_back();
    }
    f = sibling_[f];
  }
  for (Front& front : fronts_) {
    const int parent = keeper(front.parent);
    front.parent = parent >= 0 ? new_number_[parent] : -1;
  }
  // Sorts the nodes by front (counting sort).
  const int num_fronts = static_cast<int>(fronts_.size());
  front_begin_.assign(num_fronts + 1, 0);
  const int n = static_cast<int>(weight_.size());
  for (int f = 0; f < count; ++f) {
    const int front = new_number_[keeper(f)];
    for (int i = raw_pivot_[f]; i >= 0; i = member_next_[i]) {
      mark_[i] = front;
      ++front_begin_[front + 1];
    }
  }
  for (int f = 0; f < num_fronts; ++f) front_begin_[f + 1] += front_begin_[f];
  sequence_.resize(n);
  stack_.assign(front_begin_.begin(), front_begin_.end());
  for (int i = 0; i < n; ++i) sequence_[stack_[mark_[i]]++] = i;
}

}  // namespace counterpoint::contact
