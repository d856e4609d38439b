// Whether a person pays for bytes, and has told the browser so.

/** Whether an element is to load the least that is a picture. */
export const wantsFewBytes = ({ detail }) => detail === 'auto' && navigator.connection?.saveData;
