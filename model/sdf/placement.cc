#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {

bool is_sdf(const std::filesystem::path& file) {
  const std::string root = root_element_name(file);
  return root == "sdf" || root == "gazebo";
}

void add_sdf(const SdfModel& model, const Pose& X_WL, const std::string& prefix,
             ModelBuilder& builder) {
  for (const SdfModel::Tree& tree : model.trees)
    builder.add_robot(tree.robot, tree.base, X_WL * tree.X_WL, prefix);
  add_parts(model, X_WL, prefix, builder);
  for (const Note& note : model.notes) builder.add_note(note);
}

}  // namespace counterpoint
