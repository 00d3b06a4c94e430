// An SDF file as libsdformat read it, with messages that name file, line and element.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <sdf/Element.hh>
#include <sdf/Root.hh>
#include <sdf/SemanticPose.hh>
#include <string>
#include <vector>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::sdf_file {

Vector3 to_vector(const ignition::math::Vector3d& v);
Pose to_pose(const ignition::math::Pose3d& pose);

class Document {
 public:
  /// @throws InputError for what cannot be read, or includes what it may not (includes.h).
  Document(const std::filesystem::path& file, const SdfOptions& options);

  const sdf::Root& root() const { return root_; }
  const std::filesystem::path& file() const { return file_; }
  const SdfOptions& options() const { return options_; }
  /// The folder of the file that an element stands in.
  std::filesystem::path folder_of(const sdf::ElementPtr& element) const;

  /// "FILE:LINE: <joint> 'elbow'".
  std::string where(const sdf::ElementPtr& element) const;
  [[noreturn]] void fail(const sdf::ElementPtr& element, const std::string& what) const;
  /// A fault, unless the caller left out what `word` names; then a note.
  void refuse(const sdf::ElementPtr& element, LeaveOut word, const std::string& what);
  void note(const sdf::ElementPtr& element, const std::string& what);

  /// The elements within one, in order.
  std::vector<sdf::ElementPtr> children(const sdf::ElementPtr& element) const;
  /// Counts the elements within one that are not `read`, for a note.
  void pass_over_all_but(const sdf::ElementPtr& element, std::initializer_list<const char*> read);
  /// That note, and one for plugins.
  void note_passed();

  /// The element within one; null: none.
  static sdf::ElementPtr child(const sdf::ElementPtr& element, const char* name);
  /// Its number, where it is given.
  static double number(const sdf::ElementPtr& element, const char* name, double otherwise);
  static bool flag(const sdf::ElementPtr& element, const char* name, bool otherwise);

  /// A pose in a frame that libsdformat knows.
  Pose resolve(const sdf::SemanticPose& pose, const std::string& frame,
               const sdf::ElementPtr& element) const;
  void check(const sdf::Errors& errors, const sdf::ElementPtr& element) const;

  std::vector<Note> notes;
  Faults faults;  ///< of what was read so far; the reader goes on behind each

 private:
  std::filesystem::path file_;
  const SdfOptions& options_;
  sdf::Root root_;
  std::map<std::string, int> passed_;
};

}  // namespace counterpoint::sdf_file
