"""Tries settings and assumptions on a recording and says what each would change; knows no terminal and no picture."""
