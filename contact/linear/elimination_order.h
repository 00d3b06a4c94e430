// In which order the nodes of a symmetric pattern are eliminated with little fill, and which of
// them together: minimum degree on the quotient graph.
#pragma once

#include <utility>
#include <vector>

namespace counterpoint::contact {

/// Nodes have weights (numbers of velocities). The degrees are the upper bounds of Amestoy, Davis
/// and Duff ("An approximate minimum degree ordering algorithm", 1996), with its mass elimination,
/// its indistinguishable nodes and its aggressive absorption. Time and memory grow with the edges
/// and the fill, not with the square of the nodes. Memory is reused. Deterministic.
class EliminationOrder {
 public:
  /// Nodes eliminated together, and what they touch of what is left then.
  struct Front {
    int parent;                  ///< front that takes what is left of this one's rows; -1 if none
    int weight = 0;              ///< of its own nodes
    int below_weight;            ///< of those that it touches
    int below_begin, below_end;  ///< in below()
  };

  /// Couples may repeat, in either order.
  void compute(const std::vector<int>& weights, const std::vector<std::pair<int, int>>& couples);

  /// Children before parents, every subtree in a row.
  const std::vector<Front>& fronts() const { return fronts_; }
  /// Nodes in the order of elimination, front by front, and in increasing order within each.
  const std::vector<int>& sequence() const { return sequence_; }
  /// Nodes of `sequence` before those of a front.
  const std::vector<int>& front_begin() const { return front_begin_; }
  /// Nodes below the fronts, each front's in no order.
  const std::vector<int>& below() const { return below_; }

 private:
  void build_graph(const std::vector<std::pair<int, int>>& couples);
  void insert(int node, int degree);
  void remove(int node);
  int least_degree_node();
  void eliminate(int pivot);
  void gather_pivot_row(int pivot);
  void count_outside(int pivot);
  void update(int node, int pivot);
  void merge_indistinguishable();
  bool indistinguishable(int a, int b);
  void absorb(int node, int into);
  void keep_front(int pivot);
  void merge_fronts();
  void number_fronts();

  int total_ = 0, left_ = 0, stamp_ = 0, least_ = 0;
  std::vector<int> weight_;  ///< by node: with the nodes merged into it; 0 once gone
  std::vector<int> start_, length_, num_elements_;  ///< by node: in graph_, elements first
  std::vector<int> graph_, scratch_;
  std::vector<int> degree_, next_, previous_;        ///< by node: lists of equal degree
  std::vector<int> head_;                            ///< by degree
  std::vector<int> member_next_, member_last_;       ///< by node: list of those merged into it
  std::vector<int> mark_, outside_, outside_stamp_;  ///< by node or element
  std::vector<int> element_begin_, element_end_, element_weight_;  ///< by pivot: its row in rows_
  std::vector<int> rows_;
  std::vector<std::pair<unsigned, int>> hashes_;
  std::vector<int> front_of_pivot_, element_parent_;
  // By front in the order of elimination, before fronts are merged.
  std::vector<Front> raw_;
  std::vector<int> raw_pivot_, merged_into_, first_child_, sibling_, stack_;
  std::vector<int> below_;
  std::vector<Front> fronts_;
  std::vector<int> sequence_, front_begin_, new_number_;
};

}  // namespace counterpoint::contact
