// An SDF file read by libsdformat, with messages that name file, line and element.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <sdf/Element.hh>
#include <sdf/Root.hh>
#include <sdf/SemanticPose.hh>
#include <string>
#include <vector>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/sdf/includes.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::sdf_file {

Vector3 to_vector(const ignition::math::Vector3d& v);
Pose to_pose(const ignition::math::Pose3d& pose);

class Document {
 public:
  /// @throws InputError for a file that cannot be read, or that includes a file outside the allowed
  /// folders (includes.h).
  Document(const std::filesystem::path& file, const SdfOptions& options);
  /// Takes the text of a part of `file`, its lines numbered as there.
  Document(const std::filesystem::path& file, const std::string& text, const SdfOptions& options);

  const sdf::Root& root() const { return root_; }
  const std::filesystem::path& file() const { return file_; }
  const SdfOptions& options() const { return options_; }
  /// Folder of the file that contains an element.
  std::filesystem::path folder_of(const sdf::ElementPtr& element) const;

  /// Location for messages: "FILE:LINE: <joint> 'elbow'".
  std::string where(const sdf::ElementPtr& element) const;
  [[noreturn]] void fail(const sdf::ElementPtr& element, const std::string& what) const;
  /// Adds a fault, or a note if the options leave out the feature `word`.
  void refuse(const sdf::ElementPtr& element, LeaveOut word, const std::string& what);
  void note(const sdf::ElementPtr& element, const std::string& what);

  /// The child elements, in order.
  std::vector<sdf::ElementPtr> children(const sdf::ElementPtr& element) const;
  /// Counts the child elements whose names are not in `read`, for note_passed().
  void pass_over_all_but(const sdf::ElementPtr& element, std::initializer_list<const char*> read);
  /// Adds a note that lists the counted elements, and one for plugins.
  void note_passed();

  /// The child element with a name; null if there is none.
  static sdf::ElementPtr child(const sdf::ElementPtr& element, const char* name);
  /// The number or flag in a child element; `otherwise` if there is none.
  static double number(const sdf::ElementPtr& element, const char* name, double otherwise);
  static bool flag(const sdf::ElementPtr& element, const char* name, bool otherwise);

  /// The number in a child element of an SDF version after 1.9, 0 if it is none; nothing if there
  /// is no such element.
  static std::optional<double> later_number(const sdf::ElementPtr& element, const char* name);
  /// An attribute of an SDF version after 1.9 (LaterAttributes); "" if it is not given.
  std::string later(const sdf::ElementPtr& element, const char* attribute) const;

  /// Pose relative to a frame that libsdformat knows.
  Pose resolve(const sdf::SemanticPose& pose, const std::string& frame,
               const sdf::ElementPtr& element) const;
  void check(const sdf::Errors& errors, const sdf::ElementPtr& element) const;

  std::vector<Note> notes;
  Faults faults;  ///< faults found so far; reading continues after each

 private:
  std::filesystem::path file_;
  const SdfOptions& options_;
  sdf::Root root_;
  LaterAttributes later_;
  std::map<std::string, int> passed_;
};

}  // namespace counterpoint::sdf_file
