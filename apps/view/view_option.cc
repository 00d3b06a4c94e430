#include "view/view_option.h"

#include <fmt/format.h>

#include <fstream>

#include "command_line/command_line.h"
#include "view/input_files.h"

namespace counterpoint::view {

void ViewOption::add_to(apps::Command& command) {
  command.add("--view FILE", file_,
              "HTML page to write: a replay of the motion (docs/reference/replay.md)");
  command.add("--view-rate", rate_, "Frames a second of the replay [1/s]; 0: every row",
              apps::not_negative, apps::show_default, apps::seldom);
}

void ViewOption::check() const {
  if (wanted() && !can_make_pages()) throw InputError("--view: " + why_no_pages());
}

Replay make_replay(const Scene& scene, const Origin& origin, Clip clip, std::vector<Clip> ghosts) {
  Replay replay;
  replay.scene = &scene;
  replay.title = scene.name;
  replay.clip = std::move(clip);
  replay.ghosts = std::move(ghosts);
  const bool from_file = !origin.scene_file.empty();
  if (from_file) replay.visuals = read_visuals(origin.scene_file, scene.model, origin.packages);
  replay.made = made_by(origin.scene_file, scene, replay.clip);
  replay.made.insert(replay.made.end(), origin.remarks.begin(), origin.remarks.end());
  for (const std::string& note : replay.visuals.notes) replay.made.emplace_back("note", note);
  InputFiles files;
  if (from_file) files.add_scene(origin.scene_file, scene.model);
  for (const std::string& input : origin.inputs)
    if (!input.empty()) files.add(input);
  for (const std::string& name : files.left_out)
    replay.made.emplace_back("too large to keep", name);
  replay.inputs = std::move(files.files);
  return replay;
}

void write_replay(const std::filesystem::path& file, const Scene& scene, const Origin& origin,
                  Clip clip, std::vector<Clip> ghosts) {
  write_whole(file, replay_page(make_replay(scene, origin, std::move(clip), std::move(ghosts))));
}

}  // namespace counterpoint::view
