// A robot with one of everything that trajectories, scenes and column maps can name.
#pragma once

namespace counterpoint::fuzz {

inline constexpr const char* kSmallRobot =
    "<robot name='r'><link name='base'><inertial><mass value='1'/>"
    "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
    "<collision><geometry><sphere radius='0.1'/></geometry></collision></link>"
    "<link name='arm'><inertial><mass value='1'/>"
    "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
    "<collision><origin xyz='0 0 1'/><geometry><box size='.1 .1 .1'/></geometry></collision></link>"
    "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/><axis xyz='0 1 0'/>"
    "<limit lower='-1' upper='1' effort='10' velocity='2'/></joint></robot>";

}  // namespace counterpoint::fuzz
