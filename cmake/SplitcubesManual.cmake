# Installs the man page and the completion of shells. The program writes them from the options that it
# has; it does so when it is installed.
set(_manual ${PROJECT_BINARY_DIR}/manual)
install(CODE "
  file(MAKE_DIRECTORY ${_manual})
  foreach(text \"man\" \"completion bash\" \"completion zsh\" \"completion fish\")
    string(REPLACE \" \" \";\" words \${text})
    string(REPLACE \" \" \".\" name \${text})
    execute_process(COMMAND $<TARGET_FILE:splitcubes_app> \${words}
      OUTPUT_FILE ${_manual}/\${name} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()")
install(FILES ${_manual}/man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME splitcubes.1)
install(FILES ${_manual}/completion.bash
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME splitcubes)
install(FILES ${_manual}/completion.zsh
  DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _splitcubes)
install(FILES ${_manual}/completion.fish
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d RENAME splitcubes.fish)
