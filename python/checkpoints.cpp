// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/checkpoints.h"

#include "python/meshes.h"
#include "python/report.h"

namespace subvol::python {

Checkpoints::Checkpoints(Keywords& keywords) {
  for (auto [name, file] : {std::pair("checkpoint", &files_.checkpoint), std::pair("resume", &files_.resume)})
    if (const py::object path = keywords.object(name); !path.is_none()) *file = path_from(path);
  keywords.take("every", files_.every_seconds);
}

void Checkpoints::begin(const std::string& call, const Keywords& keywords,
                        const std::vector<std::pair<std::string, std::string>>& inputs) {
  Json options = to_json(keywords.in_force());
  for (const char* neutral :
       {"checkpoint", "every", "resume", "progress", "threads", "time_limit", "chord", "keep_states"})
    options.erase(neutral);
  checkpointing_.emplace(files_, cli::run_identity("python " + call, options, inputs));
}

}  // namespace subvol::python
