// Common part of the fuzz targets: bytes become a file, a parser reads it, and the only allowed
// exception is InputError.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "counterpoint/model/model.h"

namespace counterpoint::fuzz {

/// Folder of this process for files, in memory if the system has such a folder.
const std::filesystem::path& folder();

/// Writes a file into folder() and returns its path.
std::filesystem::path write(const char* name, std::string_view content);

/// Aborts if an accepted model contains an impossible number, that is, if it is silently wrong.
void check(const Model& model);

/// A robot with one of everything that trajectories, scenes and column maps can name.
inline constexpr const char* kSmallRobot =
    "<robot name='r'><link name='base'><inertial><mass value='1'/>"
    "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
    "<collision><geometry><sphere radius='0.1'/></geometry></collision></link>"
    "<link name='arm'><inertial><mass value='1'/>"
    "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
    "<collision><origin xyz='0 0 1'/><geometry><box size='.1 .1 .1'/></geometry></collision></link>"
    "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 1 0'/>"
    "<limit lower='-1' upper='1' effort='10' velocity='2'/></joint></robot>";

// The targets: each reads one input as the program does.
void read_urdf(std::string_view input);
void read_mjcf(std::string_view input);
void read_sdf(std::string_view input);
void read_srdf(std::string_view input);
void read_scene(std::string_view input);
void read_mesh_dae(std::string_view input);
void read_mesh_obj(std::string_view input);
void read_mesh_pieces(std::string_view input);
void read_mesh_stl(std::string_view input);
void read_height_image(std::string_view input);
void read_height_table(std::string_view input);
void read_bvh(std::string_view input);
void read_c3d(std::string_view input);
void read_csv(std::string_view input);
void read_hdf5(std::string_view input);
void read_mcap(std::string_view input);
void read_npz(std::string_view input);
void read_trc(std::string_view input);
void read_column_map(std::string_view input);
void read_contact_problem(std::string_view input);
void read_live_message(std::string_view input);

}  // namespace counterpoint::fuzz
