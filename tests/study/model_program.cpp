// A model for tests of --evaluator: study_model CASE [sleep in ms] [crash]. CASE is one of the reference cases by its
// name; "crash" aborts in a corner of the first two inputs.

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "../uncertainty/reference_cases.h"

int main(int argc, char** argv) {
  using namespace topple::uncertainty;
  const std::string name = argc > 1 ? argv[1] : "";
  const int pause = argc > 2 ? std::atoi(argv[2]) : 0;
  const bool crashes = argc > 3;
  for (const cases::Case& c : cases::make_all()) {
    if (c.name != name) continue;
    for (std::string line; std::getline(std::cin, line);) {
      const auto request = nlohmann::ordered_json::parse(line);
      std::vector<Point> batch(1);
      for (const auto& [key, value] : request.at("inputs").items()) batch[0].push_back(value.get<double>());
      if (pause > 0) std::this_thread::sleep_for(std::chrono::milliseconds(pause));
      if (crashes && batch[0][0] > 44 && batch[0][1] > 80) std::abort();
      std::vector<Result> results(1);
      c.model(batch, results);
      nlohmann::ordered_json answer{{"id", request.at("id")}};
      for (std::size_t i = 0; i < results[0].values.size(); ++i)
        answer["outputs"]["z" + std::to_string(i)] = results[0].values[i];
      answer["outcome"] = results[0].outcome == 0 ? "stands" : "falls";
      std::cout << answer.dump() << std::endl;
    }
    return 0;
  }
  std::cerr << "no case " << name << "\n";
  return 2;
}
