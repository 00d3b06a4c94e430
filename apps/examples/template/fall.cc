// Simulates the scene of a file for a second and prints where its first coordinates end.
#include <counterpoint/engine/engine.h>

#include <iostream>

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: fall SCENE.yaml\n";
    return 2;
  }
  try {
    counterpoint::Simulator sim(counterpoint::load_scene(arguments[1]));
    while (sim.state().time < 1.0)
      if (!sim.step().succeeded()) return 1;
    std::cout << "q after " << sim.state().time << " s: " << sim.state().q.head(3).transpose()
              << '\n';
  } catch (const counterpoint::InputError& error) {  // names the file, the line and the remedy
    std::cerr << "error: " << error.what() << '\n';
    return 2;
  }
}
