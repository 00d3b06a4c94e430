// Shows a scene in a browser while it runs; no page looks in this test.
#include <counterpoint/apps/live/viewer.h>
#include <counterpoint/model/robot_files.h>

#include <iostream>

int main(int, char** arguments) {
  using namespace counterpoint;
  Simulator simulator(load_scene(arguments[1]));
  try {
    live::Viewer viewer(simulator.scene(), arguments[1]);
    std::cout << viewer.address() << '\n';
    simulator.step();
    const bool sent = viewer.show(simulator) || !viewer.show(simulator.state(), true);
    return !sent && viewer.address().starts_with("http://127.0.0.1:") ? 0 : 1;
  } catch (const InputError& error) {
    const std::string reason = error.what();
    std::cout << "SKIPPED: " << reason << '\n';
    return reason.find("no replay page") != std::string::npos ? 0 : 1;
  }
}
