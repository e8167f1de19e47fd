# SPDX-License-Identifier: GPL-3.0-or-later
# PROGRAM fits what SAMPLES writes, in the working directory: scenes, a cutaway, an animation, a report's page.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status ERROR_VARIABLE words)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV}: ${status}\n${words}")
  endif()
endfunction()
run(${SAMPLES} .)
run(${PROGRAM} fit torus_target.off --template torus_template.mesh --levels 2 --force -o torus.glb -o cutaway:inside.glb
  -o animation:steps.glb -o torus.mesh -o cage:cage.mesh --report torus.json)
run(${PROGRAM} convert cage.mesh --limit --quantize --force -o small.glb)
run(${PROGRAM} report torus.json --force -o torus.html)
