# SPDX-License-Identifier: GPL-3.0-or-later
# PROGRAM fits what SAMPLES writes, in the working directory: scenes, a cutaway, an animation, a report's
# page, pages of the viewer.
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
run(${PROGRAM} view torus.json --force -o torus_view.html)
run(${PROGRAM} view cage.mesh --limit --force -o cage_view.html)
run(${PROGRAM} fit torus_target.off --template torus_template.mesh --order 2 --force -o curved.vtu)
run(${PROGRAM} view curved.vtu --target torus_target.off --force -o curved_view.html)
# A cell of the template is turned inside out.
file(READ torus_template.mesh tangled)
string(REGEX REPLACE "(Vertices\n[0-9]+\n)[^\n]*" "\\10 0 0 0" tangled "${tangled}")
file(WRITE tangled.mesh "${tangled}")
run(${PROGRAM} view tangled.mesh --force -o tangled_view.html)
