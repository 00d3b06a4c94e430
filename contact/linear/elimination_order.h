// Order in which the nodes of a symmetric pattern are eliminated with little fill, and which of
// them together: minimum degree on the quotient graph.
#pragma once

#include <utility>
#include <vector>

namespace counterpoint::contact {

/// Approximate minimum degree order of nodes with weights (numbers of velocities). The degrees are
/// the upper bounds of Amestoy, Davis and Duff ("An approximate minimum degree ordering algorithm",
/// 1996), with their mass elimination, indistinguishable nodes and aggressive absorption. Time and
/// memory grow with the edges and the fill, not with the square of the number of nodes. Memory is
/// reused. Deterministic.
class EliminationOrder {
 public:
  /// Nodes eliminated together, and the remaining nodes that they touch ("below").
  struct Front {
    int parent;                  ///< front that receives this one's Schur complement; -1 if none
    int weight = 0;              ///< total of its own nodes
    int below_weight;            ///< total of the nodes below
    int below_begin, below_end;  ///< range in below()
  };

  /// Computes the order. Couples may repeat, with their nodes in either order.
  void compute(const std::vector<int>& weights, const std::vector<std::pair<int, int>>& couples);

  /// Fronts in postorder: children before parents, every subtree contiguous.
  const std::vector<Front>& fronts() const { return fronts_; }
  /// Nodes in the order of elimination, front by front, and in increasing order within each.
  const std::vector<int>& sequence() const { return sequence_; }
  /// Index in sequence() of each front's first node, and the number of nodes at the end.
  const std::vector<int>& front_begin() const { return front_begin_; }
  /// Nodes below the fronts; those of a front are in no order.
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
  std::vector<int> weight_;  ///< for each node: with the nodes merged into it; 0 once gone
  /// For each node: its list in graph_, elements first.
  std::vector<int> start_, length_, num_elements_;
  std::vector<int> graph_, scratch_;
  std::vector<int> degree_, next_, previous_;   ///< for each node: lists of equal degree
  std::vector<int> head_;                       ///< first node of each degree
  std::vector<int> member_next_, member_last_;  ///< for each node: list of the nodes merged into it
  std::vector<int> mark_, outside_, outside_stamp_;  ///< for each node or element
  /// For each pivot: its row in rows_.
  std::vector<int> element_begin_, element_end_, element_weight_;
  std::vector<int> rows_;
  std::vector<std::pair<unsigned, int>> hashes_;
  std::vector<int> front_of_pivot_, element_parent_;
  // Fronts in the order of elimination, before they are merged.
  std::vector<Front> raw_;
  std::vector<int> raw_pivot_, merged_into_, first_child_, sibling_, stack_;
  std::vector<int> below_;
  std::vector<Front> fronts_;
  std::vector<int> sequence_, front_begin_, new_number_;
};

}  // namespace counterpoint::contact
