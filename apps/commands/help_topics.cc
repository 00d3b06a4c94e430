#include "command.h"

namespace counterpoint::apps {

std::vector<Topic> help_topics() {
  return {
      {"scenes", "What SCENE may be, and what a scene file holds",
       R"(SCENE is one of
  scene.yaml      a scene file: robots, bodies, ground, time step, integrator, contact options
  robot.urdf      a robot alone; --base floating frees its root link, --ground adds the plane z = 0
  humanoid_drop   the name of a bundled scene or robot ('counterpoint list scenes')

A small scene file:
  name: box and ball
  time_step: 0.002            # s
  duration: 2                 # s
  ground: {friction: 0.8}
  models:
    - name: box
      box: [0.1, 0.1, 0.1]    # m, half lengths
      mass: 1                 # kg
      position: [0, 0, 0.5]   # m
    - {name: ball, sphere: 0.1, mass: 1, position: [1, 0, 0.5]}
A robot is 'urdf: robot.urdf' (or mjcf, sdf) in place of a shape, its path relative to the scene file.

Every key: docs/reference/scene-format.md.
)"},
      {"columns", "Names of the columns of trajectories, inputs and forces",
       R"(Files are .csv, .h5 (HDF5), .npz (NumPy) or .mcap, by their ending; SI units.
  time, time_step     s, at the start of the step that the row belongs to
  elbow.q, elbow.v    coordinate and velocity of a joint: rad or m, rad/s or m/s
  base.x .. base.qw   position [m] and quaternion of a free body; base.vx .. base.wz its velocity
  elbow.u             applied force of a joint: N m or N
  elbow.target        target of its servo
  hand.fx .. hand.tz  wrench on a link: N, N m
'counterpoint inspect SCENE' lists those of a scene. More: docs/reference/trajectory-format.md.
)"},
      {"integrators", "Which integrator does what",
       R"(semi_implicit_euler  order 1; contacts, exact inverse, sleeping; the default
implicit_midpoint    order 2, energy without drift; contacts, exact inverse
runge_kutta_4        order 4; closures met exactly, no contacts, no inverse
'counterpoint accuracy SCENE' measures what each costs. More: docs/explanation/integrators.md.
)"},
      {"exit-codes", "What the command returns",
       R"(0  done
1  the computation failed: a step was not solved, a search ended with its conditions unmet
2  bad input: a file, an option; the message says what to change
)"},
  };
}

}  // namespace counterpoint::apps
