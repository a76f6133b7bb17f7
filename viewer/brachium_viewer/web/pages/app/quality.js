// Which qualities are measurements; any other is shown by its word, beside or instead of the number.

export const MEASURED = new Set(["good", "disturbed"]);
