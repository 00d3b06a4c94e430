// counterpoint export: writes a scene for other programs, as MJCF or URDF.
#include <fmt/format.h>

#include <filesystem>

#include "command.h"
#include "counterpoint/collision/collider.h"
#include "counterpoint/model/robot_files.h"
#include "input/scene_arguments.h"
#include "recordings/estimation.h"
#include "report/report.h"

namespace counterpoint::apps {
namespace {

struct ExportArguments {
  SceneArguments scene;
  std::string to, output;
  Report report;
};

void write_with_folder(const std::filesystem::path& path, const std::string& text) {
  std::error_code failed;  // an error shows again when the file is written
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), failed);
  write_file(path, text);
}

int export_scene(ExportArguments& arguments) {
  const std::filesystem::path output = arguments.output;
  const Scene scene = arguments.scene.load();
  const std::string meshes = output.stem().string() + "_meshes";
  const Exported out =
      arguments.to == "mjcf"
          ? export_mjcf(scene, {collision::Collider(scene.model).overlapping_pairs()})
          : export_urdf(scene, meshes);
  for (const ExportedFile& file : out.files)
    write_with_folder(output.parent_path() / file.name, file.text);
  write_with_folder(output, out.text);
  Report& report = arguments.report;
  report.begin("export", arguments.scene.file);
  Json lost = Json::array();
  for (const Note& note : out.lost)
    lost.push_back({{"where", note.where}, {"message", note.message}});
  report["format"] = arguments.to;
  report["output"] = output.string();
  report["mesh_files"] = out.files.size();
  report["lost"] = lost;
  report.print("{}: {} moving bodies, {} mesh files\n", output.string(), scene.model.num_joints(),
               out.files.size());
  if (!out.lost.empty()) report.print("not carried over:\n");
  for (const Note& note : out.lost) report.print("  {}: {}\n", note.where, note.message);
  report.write();
  return kSuccess;
}

}  // namespace

void add_export(CommandLine& line) {
  auto [command, arguments] = line.add<ExportArguments>(
      "export", "Write a scene as MJCF (MuJoCo) or URDF; what the format cannot say is listed",
      "Example:\n  counterpoint export humanoid_drop --to mjcf --output humanoid.xml",
      export_scene);
  arguments.scene.add_to(command);
  command.add("--to mjcf|urdf", arguments.to,
              "mjcf: the whole scene; urdf: one robot, without its start", required);
  command.add("--output FILE", arguments.output, "File to write; meshes go into a folder beside it",
              required);
  arguments.report.add_to(command);
}

}  // namespace counterpoint::apps
