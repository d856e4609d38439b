// In place of threads, in a package that is built without them.

export const teamOf = () => null;
